// resume: takes control of a paused campaign, resumes it and stays until the rig is at rest. `run`,
// which has control while it lives, resumes by a key.
#include <chrono>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "cli/commands/daemon_error.hpp"
#include "cli/terminal.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;
using SteadyClock = std::chrono::steady_clock;

bool rests(const std::string& state) {
  return state == "IDLE" || state == "FAULT";
}

class Resumption {
 public:
  Resumption(const Common& common, StreamClient& client) : common_(common), client_(client) {}
  int run();

 private:
  Result<void> follow();
  void take(const std::string& line);

  const Common& common_;
  StreamClient& client_;
  double lease_s_ = 2.0;
  bool stop_asked_ = false, resumed_ = false, failed_ = false;
  std::string state_, reason_, told_;
};

void Resumption::take(const std::string& line) {
  const Json document = Json::parse(line, nullptr, false);
  if (!document.is_object() || document.contains("jsonrpc")) return;
  const std::string type = text_of(document, "type");
  if (type == "state") {
    state_ = text_of(document, "state");
    reason_ = text_of(document, "reason");
    resumed_ = resumed_ || (state_ != "PAUSE" && !rests(state_));
  }
  if (type == "run_stop" && text_of(document, "status") != "success") failed_ = true;
  if (common_.json) {
    fmt::print("{}\n", line);
  } else if (const std::string text = narrate(document);
             !text.empty() && (type != "state" || std::exchange(told_, text) != text)) {
    fmt::print("{}\n", text);
  }
  std::fflush(stdout);
}

Result<void> Resumption::follow() {
  auto renewed = SteadyClock::now();
  while (!resumed_ || !rests(state_)) {
    if (interrupts() > 0 && !std::exchange(stop_asked_, true)) {
      fmt::print(stderr, "Stopping: the rig ramps down.\n");
      if (const auto sent = client_.send("stop"); !sent) return sent.error();
    }
    if (SteadyClock::now() - renewed > std::chrono::duration<double>(lease_s_ / 4.0)) {
      renewed = SteadyClock::now();
      if (const auto sent = client_.send("lease.renew"); !sent) return sent.error();
    }
    std::string line;
    const auto wait = client_.next(100, line);
    if (!wait) return wait.error();
    if (*wait == StreamClient::Wait::line) take(line);
  }
  return {};
}

int Resumption::run() {
  const auto before = [&](const std::string& line) {
    if (common_.json) fmt::print("{}\n", line);
  };
  const auto control = client_.ask("control.acquire", nullptr, before);
  if (!control) return unreachable(common_, control.error());
  if (control->refused) return refused(common_, *control);
  lease_s_ = number_of(control->result, "lease_s").value_or(lease_s_);
  const auto answer = client_.ask("resume", nullptr, [&](const std::string& line) { take(line); });
  if (!answer) return unreachable(common_, answer.error());
  if (answer->refused) return refused(common_, *answer);
  if (rests(text_of(answer->result, "state"))) return kOk;  // every run had ended before the pause
  if (const auto followed = follow(); !followed) return unreachable(common_, followed.error());
  if (failed_ || state_ == "FAULT")
    return fail(common_, kNegative,
                fmt::format("the campaign did not succeed: {}", printable(reason_)));
  return kOk;
}

}  // namespace

int resume(const Common& common) {
  auto client = StreamClient::connect(common.socket);
  if (!client) return unreachable(common, client.error());
  count_interrupts();
  return Resumption(common, *client).run();
}

}  // namespace shaker::cli
