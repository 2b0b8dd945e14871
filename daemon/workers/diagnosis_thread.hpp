// What does the model lack? The discrepancy workflow on a campaign's database, beside everything
// else that the daemon does.
//
// A diagnosis takes about a second of one core. It runs in a process of its own (DiagnosisChild) at
// a low priority, so that acquisition and estimator never wait for it and its end is not the
// daemon's; one at a time. It can be cancelled at once, even where its program hangs. Each one that is begun gives exactly one DiagnosisResultDocument.
#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "daemon/workers/waker.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

class DiagnosisChild;

struct DiagnosisJob {
  std::filesystem::path database;
  std::filesystem::path folder;            // for diagnosis.json, model.json and report.html
  std::optional<config::ModelSpec> model;  // nothing: the campaign's own
  double false_alarm_rate = 0.01;
  bool thorough = false;
};

class DiagnosisThread {
 public:
  // The waker outlives it. `program`: where the program of the diagnosis may be.
  DiagnosisThread(Waker& waker, std::vector<std::filesystem::path> program);
  ~DiagnosisThread();  // cancels

  // --- the clients' loop
  bool busy() const;                       // one is under way
  void begin(DiagnosisJob job);            // while none is
  void cancel(const std::string& why);     // a sentence; nothing when none is under way
  std::vector<protocol::Document> take();  // what there is to publish, in order

 private:
  void work(const std::stop_token& stop);
  void diagnose(const DiagnosisJob& job, protocol::DiagnosisResultDocument& result);
  void follow(DiagnosisChild& child, protocol::DiagnosisResultDocument& result);
  // One line of the program. False: it is none; `result` says so.
  bool take(const std::string& line, protocol::DiagnosisResultDocument& result, bool& has_ended);
  void tell(const std::string& campaign, std::string stage, double share);

  Waker& waker_;
  std::vector<std::filesystem::path> program_;
  mutable std::mutex mutex_;
  std::condition_variable_any ordered_;
  std::optional<DiagnosisJob> job_;
  bool busy_ = false;
  std::string why_cancelled_;
  std::vector<protocol::Document> documents_;
  std::atomic<bool> cancelled_ = false;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
