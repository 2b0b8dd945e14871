#include "daemon/workers/diagnosis_thread.hpp"

#include <exception>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "daemon/workers/diagnosis_child.hpp"
#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {
namespace {

using Json = nlohmann::json;

std::string text_of(const DiagnosisJob& job) {
  Json text = {{"parent", ::getpid()},
               {"database", job.database.string()},
               {"folder", job.folder.string()},
               {"false_alarm_rate", job.false_alarm_rate},
               {"thorough", job.thorough}};
  if (job.model) text["model"] = config::to_json_text(*job.model);
  return text.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// Accepts a result line only if it has the specified form; otherwise throws Json::exception.
void take_result(const Json& line, protocol::DiagnosisResultDocument& result) {
  const std::string status = line.at("status").get<std::string>();
  result.campaign = line.at("campaign").get<std::string>();
  result.reason = line.at("reason").get<std::string>();
  if (status != "done") return;
  result.folder = line.at("folder").get<std::string>();
  result.diagnosis = line.at("diagnosis").get<std::string>();
  result.status = status;
}

}  // namespace

DiagnosisThread::DiagnosisThread(Waker& waker, std::vector<std::filesystem::path> program,
                                 std::chrono::milliseconds silence)
    : waker_(waker),
      program_(std::move(program)),
      silence_(silence),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

DiagnosisThread::~DiagnosisThread() {
  cancelled_ = true;
  thread_.request_stop();
  thread_.join();
}

bool DiagnosisThread::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_;
}

void DiagnosisThread::begin(DiagnosisJob job) {
  {
    const std::lock_guard lock(mutex_);
    job_ = std::move(job);
    busy_ = true;
    why_cancelled_.clear();
    cancelled_ = false;
  }
  ordered_.notify_one();
}

void DiagnosisThread::cancel(const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (!busy_ || cancelled_) return;
  why_cancelled_ = why;
  cancelled_ = true;
}

std::vector<protocol::Document> DiagnosisThread::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(documents_, {});
}

void DiagnosisThread::work(const std::stop_token& stop) {
  name_this_thread("diagnosis");
  while (true) {
    std::optional<DiagnosisJob> job;
    {
      std::unique_lock lock(mutex_);
      if (!ordered_.wait(lock, stop, [this] { return job_.has_value(); })) return;
      job = std::exchange(job_, std::nullopt);
    }
    protocol::DiagnosisResultDocument result;
    result.database = job->database.filename().string();
    diagnose(*job, result);
    {
      const std::lock_guard lock(mutex_);
      documents_.emplace_back(std::move(result));
      busy_ = false;
    }
    waker_.wake();
  }
}

// No exception may leave a thread.
void DiagnosisThread::diagnose(const DiagnosisJob& job, protocol::DiagnosisResultDocument& result) {
  result.status = "failed";
  result.campaign = job.database.stem().string();  // until the program reports it
  try {
    auto child = DiagnosisChild::start(program_, text_of(job));
    if (!child) {
      result.reason = child.error().what;
      return;
    }
    follow(*child, result);
  } catch (const std::exception& trouble) {
    result.status = "failed";
    result.reason = fmt::format("The diagnosis failed: {}.", trouble.what());
  }
}

void DiagnosisThread::follow(DiagnosisChild& child, protocol::DiagnosisResultDocument& result) {
  using std::chrono::steady_clock;
  bool has_ended = false;
  auto heard = steady_clock::now();
  while (!has_ended) {
    if (cancelled_) {
      const std::lock_guard lock(mutex_);
      result.status = "cancelled";
      result.reason = why_cancelled_;
      return;  // the child is killed
    }
    bool good = true;
    const auto more = child.read([&](const std::string& line) {
      heard = steady_clock::now();
      if (!has_ended && good) good = take(line, result, has_ended);
    });
    if (!good) return;  // the child is killed
    if (!more) {
      result.reason = more.error().what;
      return;
    }
    if (!*more) break;
    if (steady_clock::now() - heard > silence_) {
      result.reason = fmt::format(
          "The diagnosis failed: its program said nothing for {:g} s and was ended; ask again.",
          std::chrono::duration<double>(silence_).count());
      return;  // the child is killed
    }
  }
  const std::string how = child.end();
  if (!has_ended)
    result.reason = fmt::format(
        "The diagnosis failed: its program ended with {} before it gave a result; ask again, and "
        "look into the daemon's log if that fails as well.",
        how);
}

bool DiagnosisThread::take(const std::string& text, protocol::DiagnosisResultDocument& result,
                           bool& has_ended) {
  const Json line = Json::parse(text, nullptr, false);
  try {
    if (line.is_object() && line.at("type") == "result") {
      take_result(line, result);
      has_ended = true;
      return true;
    }
    result.campaign = line.at("campaign").get<std::string>();
    tell(result.campaign, line.at("stage").get<std::string>(), line.at("share").get<double>());
    return true;
  } catch (const Json::exception&) {
    result.status = "failed";
    result.reason =
        "The diagnosis failed: its program wrote a line that is no part of a "
        "diagnosis; install program and daemon from one package.";
    return false;
  }
}

void DiagnosisThread::tell(const std::string& campaign, std::string stage, double share) {
  {
    const std::lock_guard lock(mutex_);
    documents_.emplace_back(protocol::DiagnosisProgressDocument{campaign, std::move(stage), share});
  }
  waker_.wake();
}

}  // namespace shaker::daemon
