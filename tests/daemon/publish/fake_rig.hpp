// A rig that records the commands it gets.
#pragma once

#include <string>
#include <vector>

#include "daemon/publish/commands.hpp"

namespace shaker::daemon::testing {

class FakeRig final : public RigControl {
 public:
  Result<void> may_start() override { return outcome; }
  Result<void> prove_deadman(const std::string& who, double frequency_hz,
                             double amplitude) override {
    return note("prove by " + who + " at " + std::to_string(frequency_hz) + " with " +
                std::to_string(amplitude));
  }
  Result<void> start(const std::string&, const std::string& text, const std::string& origin,
                     const std::string& directory) override {
    asked.push_back("start " + text + " from " + origin + " in " + directory);
    return outcome;
  }
  std::string database() const override { return "/data/c.db"; }
  std::string remark() const override { return remarked; }
  Result<void> stop(const std::string& who) override { return note("stop by " + who); }
  Result<void> pause(const std::string& who) override { return note("pause by " + who); }
  Result<void> resume(const std::string& who) override { return note("resume by " + who); }
  Result<void> emergency_stop(const std::string& who) override { return note("estop by " + who); }
  Result<void> acknowledge(const std::string& who) override { return note("ack by " + who); }
  void lease_lost() override { asked.emplace_back("lease lost"); }
  void set_controlled(bool now) override { controlled = now; }
  protocol::StateDocument state() const override {
    protocol::StateDocument document;
    document.state = "IDLE";
    document.controlled = controlled;
    return document;
  }

  Result<DiagnosisPlace> diagnose(const DiagnosisRequest& request) override {
    asked.push_back("diagnose \"" + request.campaign + "\" with " +
                    request.model.value_or("its own model") + " into \"" + request.out + "\"" +
                    (request.thorough ? ", thoroughly" : ""));
    if (!outcome) return outcome.error();
    return DiagnosisPlace{"c.db", "/data/c.diagnosis"};
  }
  Result<void> cancel_diagnosis(const std::string& who) override {
    return note("cancel by " + who);
  }

  std::vector<std::string> asked;
  std::string remarked;
  Result<void> outcome;
  bool controlled = false;

 private:
  Result<void> note(std::string what) {
    asked.push_back(std::move(what));
    return outcome;
  }
};

}  // namespace shaker::daemon::testing
