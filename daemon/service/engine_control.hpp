// Connects the clients' commands with the engine. Runs on the clients' thread: parses and
// checks campaigns, creates their files, and passes ready values to the engine's thread.
#pragma once

#include <memory>
#include <string>

#include "daemon/publish/commands.hpp"
#include "daemon/publish/recorder.hpp"
#include "daemon/service/diagnosis_desk.hpp"
#include "daemon/service/rig_thread.hpp"

namespace shaker::daemon {

class EngineControl final : public RigControl {
 public:
  EngineControl(RigThread& rig, ExciterThread& exciter, Recorder& recorder, DiagnosisDesk& desk,
                double excitation_max)
      : rig_(rig),
        exciter_(exciter),
        recorder_(recorder),
        desk_(desk),
        excitation_max_(excitation_max) {}

  // From now on no campaign starts.
  void close() { closed_ = true; }
  const std::string& starter() const { return starter_; }  // who started the last motion
  // The campaign that began last; null before the first one.
  std::shared_ptr<const config::CampaignSpec> last_campaign() const { return last_campaign_; }

  Result<void> may_start() override;
  Result<void> start(const std::string& who, const std::string& text, const std::string& origin,
                     const std::string& directory) override;
  std::string database() const override { return recorder_.prepared_file().string(); }
  std::string remark() const override;
  Result<void> prove_deadman(const std::string& who, double frequency_hz,
                             double amplitude) override;
  Result<void> stop(const std::string& who) override;
  Result<void> pause(const std::string& who) override;
  Result<void> resume(const std::string& who) override;
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
  using Begin = Result<void> (Engine::*)(const config::CampaignSpec&);
  Result<void> begin(std::shared_ptr<const config::CampaignSpec> wanted, Begin how);

  RigThread& rig_;
  ExciterThread& exciter_;
  Recorder& recorder_;
  DiagnosisDesk& desk_;
  double excitation_max_;  // of the rig, m/s^2
  bool closed_ = false;
  std::string starter_;
  std::shared_ptr<const config::CampaignSpec> last_campaign_;
};

}  // namespace shaker::daemon
