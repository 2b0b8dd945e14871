#include "daemon/simulated_campaign.hpp"

#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/online/online_estimator.hpp"

namespace shaker::daemon {
namespace {

constexpr Nanoseconds kStatusPeriod = std::chrono::milliseconds(50);
constexpr std::size_t kBatch = 4096;

// Obeys at once; reports errors in the next turn, as a thread would.
class InlineExciter final : public ExciterCommands {
 public:
  InlineExciter(drivers::Exciter& exciter, const Clock& clock, Nanoseconds heartbeat_period)
      : exciter_(exciter), clock_(clock), heartbeat_period_(heartbeat_period) {}

  void set(const drivers::Setpoint& setpoint) override { keep(exciter_.write(setpoint)); }
  void stop() override { keep(exciter_.stop()); }
  void clear_fault() override { keep(exciter_.clear_fault()); }
  void keep_alive(bool wanted) override {
    alive_ = wanted;
    next_beat_ = clock_.now();
  }

  void turn(Engine& engine) {
    if (alive_ && clock_.now() >= next_beat_) {
      next_beat_ += heartbeat_period_;
      keep(exciter_.heartbeat());
    }
    if (clock_.now() >= next_status_) {
      next_status_ = clock_.now() + kStatusPeriod;
      const auto status = exciter_.read();
      status ? engine.on_exciter_status(*status) : errors_.push_back(status.error());
    }
    for (; !errors_.empty(); errors_.pop_front())
      engine.on_exciter_error(errors_.front());
  }

 private:
  void keep(const Result<void>& result) {
    if (!result) errors_.push_back(result.error());
  }

  drivers::Exciter& exciter_;
  const Clock& clock_;
  Nanoseconds heartbeat_period_, next_beat_{}, next_status_{};
  bool alive_ = false;
  std::deque<Error> errors_;
};

class InlineEstimator final : public EstimatorCommands {
 public:
  // Builds the estimator at once, so that an unknown model throws here.
  explicit InlineEstimator(const config::ModelSpec& model) : estimator_(model) {}

  void begin(const config::ModelSpec& model, const estimator::OnlineOptions& options) override {
    estimator_ = estimator::OnlineEstimator(model, options);
  }
  void add(const estimator::MeasuredCycle& cycle, Nanoseconds last_sample) override {
    accepted.push_back(cycle);
    outcomes_.push_back({.run = cycle.run,
                         .cycle = cycle.index,
                         .last_sample = last_sample,
                         .estimate = estimator_.add(cycle)});
  }
  void turn(Engine& engine) {
    for (; !outcomes_.empty(); outcomes_.pop_front())
      engine.on_estimate(outcomes_.front());
  }

  std::vector<estimator::MeasuredCycle> accepted;

 private:
  estimator::OnlineEstimator estimator_;
  std::deque<EstimateOutcome> outcomes_;
};

class CollectingOutlet final : public Outlet {
 public:
  Result<void> record_campaign(const config::CampaignSpec&) override {
    open = true;
    return {};
  }
  Result<void> record_run(int, const config::RunSpec&) override { return {}; }
  Result<void> record_samples(std::span<const drivers::Sample> taken) override {
    samples += taken.size();
    return {};
  }
  Result<void> record_cycle(const estimator::MeasuredCycle&, bool) override { return {}; }
  void close_campaign() override { open = false; }
  Result<void> publish(const protocol::Document& document) override {
    documents.push_back(document);
    return {};
  }

  std::vector<protocol::Document> documents;
  std::uint64_t samples = 0;
  bool open = false;
};

class Simulation {
 public:
  Simulation(const config::RigConfig& rig, const config::CampaignSpec& campaign,
             const SimulationOptions& options, drivers::Devices& devices, SimulatedClock& clock)
      : options_(options),
        devices_(devices),
        clock_(clock),
        begin_(clock.now()),
        exciter_(*devices.exciter, clock, from_seconds(rig.exciter.heartbeat_period_s)),
        estimator_(campaign.model),
        engine_(rig, clock, exciter_, estimator_, outlet_),
        batch_(kBatch) {}

  Result<SimulatedCampaign> run(const config::CampaignSpec& campaign) {
    if (auto ok = devices_.exciter->connect(); !ok) return ok.error();
    for (auto& sensor : devices_.sensors) {
      if (auto ok = sensor->connect(); !ok) return ok.error();
    }
    for (int i = 0; i < 20; ++i)
      turn();
    if (auto ok = engine_.start(campaign); !ok) return ok.error();
    while (outlet_.open || (engine_.state() != State::idle && engine_.state() != State::fault)) {
      if (elapsed() > options_.at_most_s) {
        return Error{ErrorKind::timeout,
                     fmt::format("the simulated campaign is not over after {:g} s; it is in {}: {}",
                                 options_.at_most_s, engine_.state_document().state,
                                 engine_.state_document().reason)};
      }
      turn();
    }
    return SimulatedCampaign{.documents = std::move(outlet_.documents),
                             .accepted = std::move(estimator_.accepted),
                             .samples = outlet_.samples,
                             .duration_s = elapsed(),
                             .final_state = engine_.state()};
  }

 private:
  double elapsed() const { return seconds(clock_.now() - begin_); }

  void turn() {
    clock_.advance(options_.tick);
    for (auto& sensor : devices_.sensors) {
      for (bool more = true; more;) {
        const auto count = sensor->read(batch_, Nanoseconds{0});
        if (!count) {
          engine_.on_sensor_error(count.error());
          break;
        }
        engine_.on_samples(std::span(batch_).first(*count));
        more = *count == batch_.size();
      }
      engine_.on_sensor_health(sensor->health(), sensor->stamp_source());
    }
    exciter_.turn(engine_);
    estimator_.turn(engine_);
    engine_.tick();
    if (options_.each_tick) options_.each_tick(engine_, elapsed());
  }

  const SimulationOptions& options_;
  drivers::Devices& devices_;
  SimulatedClock& clock_;
  Nanoseconds begin_;
  CollectingOutlet outlet_;
  InlineExciter exciter_;
  InlineEstimator estimator_;
  Engine engine_;
  std::vector<drivers::Sample> batch_;
};

}  // namespace

Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options,
                                                 drivers::Devices& devices, SimulatedClock& clock) {
  std::optional<Simulation> simulation;
  try {
    simulation.emplace(rig, campaign, options, devices, clock);
  } catch (const std::invalid_argument& unknown) {  // unknown model, see OnlineEstimator
    return Error{ErrorKind::invalid, unknown.what()};
  }
  return simulation->run(campaign);
}

Result<SimulatedCampaign> run_simulated_campaign(const config::RigConfig& rig,
                                                 const config::CampaignSpec& campaign,
                                                 const SimulationOptions& options) {
  SimulatedClock clock;
  auto devices = drivers::make_devices(rig, clock);
  if (!devices) return devices.error();
  return run_simulated_campaign(rig, campaign, options, *devices, clock);
}

}  // namespace shaker::daemon
