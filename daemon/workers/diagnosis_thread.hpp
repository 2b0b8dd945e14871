// Runs diagnoses of campaign databases in parallel to the daemon's other work.
//
// A diagnosis takes about a second of one core. It runs in a separate process (DiagnosisChild)
// at a low priority, so that acquisition and estimator never wait for it and its crash does not
// end the daemon. One diagnosis runs at a time. It can be cancelled at once, even if its
// program hangs. Each one that is begun gives exactly one DiagnosisResultDocument.
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
  std::optional<config::ModelSpec> model;  // empty: the campaign's own
  double false_alarm_rate = 0.01;
  bool thorough = false;
};

class DiagnosisThread {
 public:
  // `waker` outlives it. `program`: possible paths of the diagnosis program. A program without
  // output for `silence` hangs and is killed; the longest stage without progress takes seconds.
  DiagnosisThread(Waker& waker, std::vector<std::filesystem::path> program,
                  std::chrono::milliseconds silence = std::chrono::minutes(10));
  ~DiagnosisThread();  // cancels

  // --- the clients' loop
  bool busy() const;                       // a diagnosis runs
  void begin(DiagnosisJob job);            // precondition: not busy
  void cancel(const std::string& why);     // `why` is a sentence; no effect if not busy
  std::vector<protocol::Document> take();  // documents to publish, in order

 private:
  void work(const std::stop_token& stop);
  void diagnose(const DiagnosisJob& job, protocol::DiagnosisResultDocument& result);
  void follow(DiagnosisChild& child, protocol::DiagnosisResultDocument& result);
  // Handles one line of the program. Returns false if the line is invalid; `result` then has
  // the reason.
  bool take(const std::string& line, protocol::DiagnosisResultDocument& result, bool& has_ended);
  void tell(const std::string& campaign, std::string stage, double share);

  Waker& waker_;
  std::vector<std::filesystem::path> program_;
  std::chrono::milliseconds silence_;
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
