#include "daemon/service/engine_control.hpp"

#include <exception>
#include <memory>

#include <fmt/format.h>

#include "config/campaign.hpp"
#include "daemon/estimator_options.hpp"
#include "estimator/online/online_estimator.hpp"

namespace shaker::daemon {
namespace {

constexpr double kSmallPart = 0.1;  // of the rig's largest excitation, limit of a proof in motion

// Takes back a motion that begins although its client was told that it does not.
Result<void> stop_again(Engine& engine) {
  return engine.stop("shakerd, because its answer to the client would have come too late");
}

// Refuses a model that cannot be built, before any motion.
Result<void> prove_model(const config::CampaignSpec& campaign) {
  try {
    const estimator::OnlineEstimator built(campaign.model, estimator::OnlineOptions{});
  } catch (const std::exception& trouble) {
    return Error{ErrorKind::invalid, fmt::format("campaign \"{}\": model \"{}\": {}", campaign.name,
                                                 campaign.model.name, trouble.what())};
  }
  return {};
}

}  // namespace

Result<void> EngineControl::may_start() {
  if (closed_) {
    return Error{ErrorKind::refused, "The daemon is about to end; start it again first."};
  }
  return rig_.ask([](Engine& engine) { return engine.may_start(); });
}

Result<void> EngineControl::start(const std::string& who, const std::string& text,
                                  const std::string& origin, const std::string& directory) {
  if (auto may = may_start(); !may) return may;
  auto campaign = config::parse_campaign(text, origin, directory);
  if (!campaign) return campaign.error();
  if (auto good = prove_model(*campaign); !good) return good;
  starter_ = who;
  return begin(std::make_shared<const config::CampaignSpec>(std::move(*campaign)), &Engine::start);
}

std::string EngineControl::remark() const {
  return last_campaign_ ? daemon::remark(*last_campaign_) : std::string();
}

Result<void> EngineControl::prove_deadman(const std::string& who, double frequency_hz,
                                          double amplitude) {
  if (auto may = may_start(); !may) return may;
  if (!(amplitude <= kSmallPart * excitation_max_)) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{:g} m/s^2 is no small amplitude: the dead-man is proved with at most "
                    "{:g} m/s^2, a tenth of the rig's excitation_max_m_s2.",
                    amplitude, kSmallPart * excitation_max_)};
  }
  auto gentle = std::make_shared<config::CampaignSpec>();
  gentle->name = "deadman-proof";
  gentle->model.name = "none";
  gentle->runs.push_back({"proof", frequency_hz, amplitude, 1});
  starter_ = who;
  return begin(std::move(gentle), &Engine::prove_deadman);
}

// The campaign is shared, because a question that timed out outlives this call.
Result<void> EngineControl::begin(std::shared_ptr<const config::CampaignSpec> wanted, Begin how) {
  const auto admitted = rig_.ask([wanted](Engine& engine) { return engine.admit(*wanted); });
  if (!admitted) return admitted;
  if (auto made = recorder_.prepare(*wanted, starter_); !made) return made;
  const auto begun =
      rig_.ask([wanted, how](Engine& engine) { return (engine.*how)(*wanted); }, stop_again);
  if (begun) last_campaign_ = wanted;
  if (!begun) recorder_.discard();
  return begun;
}

Result<void> EngineControl::stop(const std::string& who) {
  return rig_.ask_urgently([who](Engine& engine) { return engine.stop(who); });
}

// A late pause does no harm; a late resumption is taken back.
Result<void> EngineControl::pause(const std::string& who) {
  return rig_.ask_urgently([who](Engine& engine) { return engine.pause(who); });
}

Result<void> EngineControl::resume(const std::string& who) {
  return rig_.ask([who](Engine& engine) { return engine.resume(who); }, stop_again);
}

// Stops the exciter first, so that a stuck engine does not keep the table moving.
Result<void> EngineControl::emergency_stop(const std::string& who) {
  exciter_.emergency_stop();
  return rig_.ask_urgently([who](Engine& engine) { return engine.emergency_stop(who); });
}

Result<void> EngineControl::acknowledge(const std::string& who) {
  return rig_.ask([who](Engine& engine) { return engine.acknowledge(who); });
}

void EngineControl::lease_lost() {
  rig_.tell([](Engine& engine) { engine.lease_lost(); });
}

void EngineControl::set_controlled(bool controlled) {
  rig_.tell([controlled](Engine& engine) { engine.set_controlled(controlled); });
}

}  // namespace shaker::daemon
