// The engine as the commands of clients want it: campaigns come as text.
#pragma once

#include <string>

#include "daemon/engine.hpp"
#include "daemon/publish/commands.hpp"
#include "daemon/service/diagnosis_desk.hpp"

namespace shaker::daemon {

class EngineControl final : public RigControl {
 public:
  EngineControl(Engine& engine, DiagnosisDesk& desk) : engine_(engine), desk_(desk) {}

  // From now on no campaign starts.
  void close() { closed_ = true; }

  Result<void> start(const std::string& text, const std::string& origin,
                     const std::string& directory) override;
  Result<void> stop(const std::string& who) override { return engine_.stop(who); }
  Result<void> emergency_stop(const std::string& who) override {
    return engine_.emergency_stop(who);
  }
  Result<void> acknowledge(const std::string& who) override { return engine_.acknowledge(who); }
  void lease_lost() override { engine_.lease_lost(); }
  void set_controlled(bool controlled) override { engine_.set_controlled(controlled); }
  protocol::StateDocument state() const override { return engine_.state_document(); }
  Result<DiagnosisPlace> diagnose(const DiagnosisRequest& request) override {
    return desk_.begin(request, engine_.state());
  }
  Result<void> cancel_diagnosis(const std::string& who) override { return desk_.cancel(who); }

 private:
  Engine& engine_;
  DiagnosisDesk& desk_;
  bool closed_ = false;
};

}  // namespace shaker::daemon
