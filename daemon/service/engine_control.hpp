// The engine as the commands of clients want it: campaigns come as text.
#pragma once

#include <string>

#include "daemon/engine.hpp"
#include "daemon/publish/commands.hpp"

namespace shaker::daemon {

class EngineControl final : public RigControl {
 public:
  explicit EngineControl(Engine& engine) : engine_(engine) {}

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

 private:
  Engine& engine_;
  bool closed_ = false;
};

}  // namespace shaker::daemon
