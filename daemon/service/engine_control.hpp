// The engine as the commands of clients want it. On the clients' thread: campaigns come as text,
// are read, proved and given a file here, and are handed to the engine's thread as ready values.
#pragma once

#include <string>

#include "daemon/publish/commands.hpp"
#include "daemon/publish/recorder.hpp"
#include "daemon/service/diagnosis_desk.hpp"
#include "daemon/service/rig_thread.hpp"

namespace shaker::daemon {

class EngineControl final : public RigControl {
 public:
  EngineControl(RigThread& rig, ExciterThread& exciter, Recorder& recorder, DiagnosisDesk& desk)
      : rig_(rig), exciter_(exciter), recorder_(recorder), desk_(desk) {}

  // From now on no campaign starts.
  void close() { closed_ = true; }

  Result<void> may_start() override;
  Result<void> start(const std::string& text, const std::string& origin,
                     const std::string& directory) override;
  Result<void> stop(const std::string& who) override;
  Result<void> emergency_stop(const std::string& who) override;
  Result<void> acknowledge(const std::string& who) override;
  void lease_lost() override;
  void set_controlled(bool controlled) override;
  protocol::StateDocument state() const override { return rig_.state_document(); }
  Result<DiagnosisPlace> diagnose(const DiagnosisRequest& request) override {
    return desk_.begin(request, rig_.state());
  }
  Result<void> cancel_diagnosis(const std::string& who) override { return desk_.cancel(who); }

 private:
  RigThread& rig_;
  ExciterThread& exciter_;
  Recorder& recorder_;
  DiagnosisDesk& desk_;
  bool closed_ = false;
};

}  // namespace shaker::daemon
