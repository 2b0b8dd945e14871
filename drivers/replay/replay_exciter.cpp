#include "drivers/replay/replay_exciter.hpp"

namespace shaker::drivers::replay {
namespace {

class ReplayExciter final : public Exciter {
 public:
  explicit ReplayExciter(const Clock& clock) : clock_(clock) {}

  std::string description() const override { return "replay exciter, which moves nothing"; }
  Result<void> connect() override { return {}; }
  Result<void> write(const Setpoint& setpoint) override {
    setpoint_ = setpoint;
    return {};
  }
  Result<ExciterStatus> read() override {
    ExciterStatus status;
    status.t = clock_.now();
    status.ready = true;
    status.running = setpoint_.enable && setpoint_.amplitude > 0.0;
    status.frequency_hz = setpoint_.frequency_hz;
    status.amplitude = setpoint_.enable ? setpoint_.amplitude : 0.0;
    return status;
  }
  Result<void> heartbeat() override { return {}; }
  Result<void> stop() override {
    setpoint_ = {};
    return {};
  }

 private:
  const Clock& clock_;
  Setpoint setpoint_;
};

}  // namespace

std::unique_ptr<Exciter> make_replay_exciter(const Clock& clock) {
  return std::make_unique<ReplayExciter>(clock);
}

}  // namespace shaker::drivers::replay
