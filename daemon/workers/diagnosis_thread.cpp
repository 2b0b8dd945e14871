#include "daemon/workers/diagnosis_thread.hpp"

#include <algorithm>
#include <exception>
#include <pthread.h>
#include <sched.h>
#include <utility>

#include <fmt/format.h>
#include <sys/resource.h>

#include "config/campaign.hpp"
#include "daemon/workers/thread_name.hpp"
#include "estimator/discrepancy/diagnose.hpp"
#include "record/accepted_cycles.hpp"
#include "report/diagnosis_document.hpp"
#include "report/diagnosis_files.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::daemon {
namespace {

using estimator::discrepancy::Campaign;
using estimator::discrepancy::Diagnosis;
using estimator::discrepancy::recording_of;

constexpr int kNice = 10;

// Thrown by the progress of a diagnosis that is not wanted any more, caught by its thread.
struct Cancelled {};

// Of the calling thread alone. It may have been born with SCHED_FIFO, where niceness means nothing.
// Where even that is forbidden, the diagnosis is done all the same: nothing moves then.
void step_back() {
  const sched_param none{};
  ::pthread_setschedparam(::pthread_self(), SCHED_BATCH, &none);
  ::setpriority(PRIO_PROCESS, 0, kNice);  // 0: this thread, on Linux
}

Result<Campaign> campaign_of(const record::CampaignReader& reader, const record::CampaignRow& row) {
  auto runs = record::accepted_cycles(reader);
  if (!runs) return runs.error();
  Campaign campaign;
  campaign.name = row.name;
  const double mass = config::reference_mass(row.spec_json);
  for (record::AcceptedCycles& run : *runs)
    add_cycles(campaign, recording_of(std::move(run)), mass);
  if (campaign.runs.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("The campaign {} holds no accepted cycle: there is nothing to "
                             "diagnose; run it again.",
                             row.name)};
  return campaign;
}

}  // namespace

DiagnosisThread::DiagnosisThread(Waker& waker)
    : waker_(waker), thread_([this](const std::stop_token& stop) { work(stop); }) {}

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
  step_back();
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

// Nothing may leave a thread by exception.
void DiagnosisThread::diagnose(const DiagnosisJob& job, protocol::DiagnosisResultDocument& result) {
  result.status = "failed";
  try {
    const auto found = find(job, result.campaign);
    if (!found) {
      result.reason = found.error().what;
      return;
    }
    if (auto written = report::write_diagnosis(job.folder, *found); !written) {
      result.reason = written.error().what;
      return;
    }
    result.diagnosis = report::diagnosis_json(*found);
    result.reason = report::diagnosis_sentence(*found);
    result.folder = std::filesystem::absolute(job.folder).string();
    result.status = "done";
  } catch (const Cancelled&) {
    const std::lock_guard lock(mutex_);
    result.status = "cancelled";
    result.reason = why_cancelled_;
  } catch (const std::exception& trouble) {
    result.reason = fmt::format("The diagnosis failed: {}.", trouble.what());
  }
}

Result<Diagnosis> DiagnosisThread::find(const DiagnosisJob& job, std::string& name) {
  name = job.database.stem().string();  // until the database has said it
  tell(name, "reading", 0.0);
  const auto reader = record::CampaignReader::open(job.database);
  if (!reader) return reader.error();
  const auto row = reader->campaign();
  if (!row) return row.error();
  name = row->name;
  const auto model = job.model
                         ? Result<config::ModelSpec>(*job.model)
                         : config::parse_model(row->model_json, job.database.filename().string());
  if (!model) return model.error();
  if (model->length_unit != "m")
    return Error{
        ErrorKind::invalid,
        fmt::format("The model counts in \"{}\" and the campaign in m: these do not match; "
                    "give a model in metres.",
                    model->length_unit)};
  const auto campaign = campaign_of(*reader, *row);
  if (!campaign) return campaign.error();
  estimator::discrepancy::DiagnoseOptions options;
  options.false_alarm_rate = job.false_alarm_rate;
  if (job.thorough) options.effort = estimator::discrepancy::kThorough;
  options.calibrations = &calibrations_;
  return estimator::discrepancy::diagnose(
      *campaign, *model, options,
      [&](std::string_view stage, double share) { tell(name, stage, share); });
}

void DiagnosisThread::tell(const std::string& campaign, std::string_view stage, double share) {
  if (cancelled_) throw Cancelled{};
  {
    const std::lock_guard lock(mutex_);
    documents_.emplace_back(
        protocol::DiagnosisProgressDocument{campaign, std::string(stage), share});
  }
  waker_.wake();
}

}  // namespace shaker::daemon
