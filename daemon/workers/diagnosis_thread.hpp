// What does the model lack? The discrepancy workflow on a campaign's database, beside everything
// else that the daemon does.
//
// A diagnosis takes about a second of one core. It runs at a low priority, so that acquisition and
// estimator never wait for it, one at a time, and can be cancelled: it ends at its next step,
// within a fraction of a second. Each one that is begun gives exactly one DiagnosisResultDocument.
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
#include "estimator/discrepancy/campaign.hpp"
#include "estimator/discrepancy/detect/calibration_cache.hpp"
#include "estimator/discrepancy/diagnosis.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

struct DiagnosisJob {
  std::filesystem::path database;
  std::filesystem::path folder;            // for diagnosis.json, model.json and report.html
  std::optional<config::ModelSpec> model;  // nothing: the campaign's own
  double false_alarm_rate = 0.01;
  bool thorough = false;
};

class DiagnosisThread {
 public:
  explicit DiagnosisThread(Waker& waker);  // which outlives it
  ~DiagnosisThread();                      // cancels

  // --- the clients' loop
  bool busy() const;                       // one is under way
  void begin(DiagnosisJob job);            // while none is
  void cancel(const std::string& why);     // a sentence; nothing when none is under way
  std::vector<protocol::Document> take();  // what there is to publish, in order

 private:
  void work(const std::stop_token& stop);
  void diagnose(const DiagnosisJob& job, protocol::DiagnosisResultDocument& result);
  Result<estimator::discrepancy::Diagnosis> find(const DiagnosisJob& job, std::string& campaign);
  void tell(const std::string& campaign, std::string_view stage, double share);

  Waker& waker_;
  mutable std::mutex mutex_;
  std::condition_variable_any ordered_;
  std::optional<DiagnosisJob> job_;
  bool busy_ = false;
  std::string why_cancelled_;
  std::vector<protocol::Document> documents_;
  std::atomic<bool> cancelled_ = false;
  estimator::discrepancy::CalibrationCache calibrations_;  // of this process
  std::jthread thread_;                                    // last
};

}  // namespace shaker::daemon
