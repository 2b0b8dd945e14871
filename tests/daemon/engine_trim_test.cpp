// The amplitude of the table is trimmed to what the run asks for. The truth about the table comes
// from the virtual rig, past the daemon.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/simulated_campaign.hpp"
#include "drivers/sim/simulated_devices.hpp"
#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::bench_rig;
using testing::EngineBench;
using ::testing::HasSubstr;

constexpr double kRampS = 1.0;

// Runs a campaign on a virtual rig with a table that is off, and watches the table itself.
class WatchedTable {
 public:
  WatchedTable(double gain, double drift_per_minute) {
    rig_.name = "weak";
    rig_.exciter.device = config::SimulatedExciter{};
    rig_.exciter.ramp_s = kRampS;
    rig_.limits.stroke_max_m = 0.185;
    rig_.limits.excitation_max_m_s2 = 5.0;
    rig_.sensors = {config::SimulatedSensor{}};
    options_.parameters = {{"table_gain", gain}, {"table_drift", drift_per_minute / 60.0}};
    virtual_rig_ = std::make_shared<drivers::sim::SimulatedRig>(options_, clock_);
  }

  SimulatedCampaign run(const config::CampaignSpec& campaign) {
    drivers::Devices devices;
    devices.exciter = std::make_unique<drivers::sim::SimulatedExciter>(virtual_rig_);
    devices.sensors.push_back(std::make_unique<drivers::sim::SimulatedSensor>(virtual_rig_));
    SimulationOptions options;
    options.tick = std::chrono::milliseconds(2);
    options.each_tick = [this](Engine&, double) {
      virtual_rig_->at_now([this](sim::VirtualRig& rig) {
        largest_motion = std::max(largest_motion, std::abs(rig.true_excitation()));
        largest_order = std::max(largest_order, rig.settings().amplitude);
      });
    };
    auto result = run_simulated_campaign(rig_, campaign, options, devices, clock_);
    EXPECT_TRUE(result.ok()) << result.error().what;
    return result ? std::move(*result) : SimulatedCampaign{};
  }

  double largest_motion = 0.0, largest_order = 0.0;

 private:
  config::RigConfig rig_;
  sim::RigOptions options_;
  SimulatedClock clock_;
  std::shared_ptr<drivers::sim::SimulatedRig> virtual_rig_;
};

config::CampaignSpec dwells() {
  auto campaign =
      config::load_campaign(std::string(SHAKER_SOURCE_DIR) + "/config/examples/campaign-demo.json")
          .value();
  campaign.runs = {{"slow", 2.0, 3.0, 30}, {"fast", 3.0, 3.5, 40}, {"more", 3.0, 4.0, 40}};
  return campaign;
}

double asked_in(const config::CampaignSpec& campaign, const std::string& run) {
  return std::ranges::find(campaign.runs, run, &config::RunSpec::name)->amplitude;
}

TEST(EngineTrim, IsWithinOnePercentAfterFiveCyclesOnATableThatIsWeakAndDrifts) {
  WatchedTable table(0.85, -0.05);
  const auto campaign = dwells();
  const auto result = table.run(campaign);
  ASSERT_EQ(result.final_state, State::idle);
  int accepted = 0;
  double worst = 0.0;
  for (const auto& document : result.documents) {
    const auto* cycle = std::get_if<protocol::CycleDocument>(&document);
    if (cycle == nullptr) continue;
    const double off = cycle->amplitude / asked_in(campaign, cycle->run) - 1.0;
    // No false settling: nothing is accepted at another amplitude.
    if (cycle->cycle >= 5 || cycle->accepted) {
      EXPECT_LE(std::abs(off), 0.01) << cycle->run << " " << cycle->cycle;
      worst = std::max(worst, std::abs(off));
    }
    accepted += cycle->accepted ? 1 : 0;
  }
  EXPECT_EQ(accepted, 110);
  EXPECT_LE(table.largest_motion, 4.0 * 1.01) << "of the table itself";
  EXPECT_LE(table.largest_order, 5.0);
  std::printf("after 5 cycles %.2f %% off at most; the table moved with %.3f m/s^2 at most\n",
              100.0 * worst, table.largest_motion);
}

TEST(EngineTrim, RecordsEveryCorrectionInTheCycles) {
  WatchedTable table(0.85, -0.05);
  const auto result = table.run(dwells());
  std::optional<double> order;
  std::string run;
  int corrections = 0;
  for (const auto& document : result.documents) {
    const auto* cycle = std::get_if<protocol::CycleDocument>(&document);
    if (cycle == nullptr) continue;
    ASSERT_TRUE(cycle->ordered.has_value());
    if (cycle->run == run) {
      EXPECT_DOUBLE_EQ(*cycle->ordered, *order) << cycle->cycle;
    }
    run = cycle->run;
    order = cycle->corrected_to ? cycle->corrected_to : cycle->ordered;
    corrections += cycle->corrected_to ? 1 : 0;
  }
  EXPECT_GT(corrections, 10) << "the table drifts";
}

TEST(EngineTrim, RecordsACorrectionOnce) {
  auto rig = bench_rig();
  rig.limits.stale_s = 0.5;
  EngineBench bench(rig);
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  bench.exciter.moves_part = 0.99;
  const auto cycles = [&] { return bench.outlet.all<protocol::CycleDocument>(); };
  for (int i = 0; i < 1000 && !cycles().back().corrected_to; ++i)
    bench.step();
  ASSERT_TRUE(cycles().back().corrected_to.has_value());
  bench.silent = true;  // the next cycle has a gap
  bench.run(0.1);
  bench.silent = false;
  const auto before = cycles().size();
  bench.run(0.6);
  ASSERT_GT(cycles().size(), before);
  EXPECT_EQ(cycles()[before].why.substr(0, 3), "gap");
  EXPECT_FALSE(cycles()[before].corrected_to.has_value());
}

// What the table does while an order is on its way says nothing about that order.
TEST(EngineTrim, WaitsForTheRampOfACorrectionBeforeTheNextOne) {
  auto rig = bench_rig();
  rig.limits.frequency_max_hz = 20.0;
  EngineBench bench(rig);
  auto campaign = bench_campaign(1, 1000);
  campaign.runs[0].frequency_hz = 20.0;  // ten cycles lie within the ramp
  ASSERT_TRUE(bench.measuring(campaign));
  bench.exciter.moves_part = 0.92;
  bench.run(6.0);
  double highest = 0.0;
  for (const auto& order : bench.exciter.sets)
    highest = std::max(highest, order.amplitude);
  EXPECT_NEAR(bench.exciter.sets.back().amplitude, 4.0 / 0.92, 0.01);
  EXPECT_LT(highest, 1.005 * 4.0 / 0.92);
}

// Late time stamps, or a shock, may disturb single cycles.
TEST(EngineTrim, DoesNotFollowASingleCycle) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  const std::size_t before = bench.exciter.sets.size();
  for (const double part : {1.05, 0.96, 1.08}) {
    bench.excitation_gain = part;
    bench.run(0.2);  // touches two cycles of 0.25 s at most
    bench.excitation_gain = 1.0;
    bench.run(3.0);
  }
  EXPECT_EQ(bench.exciter.sets.size(), before);
}

TEST(EngineTrim, NeverOrdersMoreThanTheLimitAndSaysThatItIsNotEnough) {
  WatchedTable table(0.85, 0.0);
  auto campaign = dwells();
  campaign.runs = {{"high", 3.0, 4.8, 10}};  // 5.6 would have to be ordered; 5 is the limit
  const auto result = table.run(campaign);
  EXPECT_LE(table.largest_order, 5.0);
  EXPECT_LE(table.largest_motion, 5.0);
  int told = 0;
  for (const auto& document : result.documents) {
    const auto* alarm = std::get_if<protocol::AlarmDocument>(&document);
    if (alarm != nullptr && alarm->code == "trim_limited") ++told;
  }
  EXPECT_EQ(told, 1);
  EXPECT_EQ(result.final_state, State::idle) << "the campaign goes on with what there is";
}

TEST(EngineTrim, LowersTheOrderOfATableThatIsTooStrong) {
  WatchedTable table(1.12, 0.0);
  const auto result = table.run(dwells());
  ASSERT_EQ(result.final_state, State::idle);
  EXPECT_LE(table.largest_motion, 4.0 * 1.01) << "it never rises to 4.48";
  EXPECT_LT(table.largest_order, 3.7);
}

TEST(EngineTrim, IsOffWhereTheExcitationIsNotMeasured) {
  auto rig = bench_rig();
  config::CanSensor stroke;
  stroke.signals.push_back(
      {.channel = protocol::Channel::displacement, .message = "M", .signal = "u"});
  rig.sensors = {stroke};
  EngineBench bench(rig);
  bench.excitation_silent = true;
  bench.exciter.moves_part = 0.85;
  ASSERT_TRUE(bench.measuring());
  bench.run(10.0);
  EXPECT_EQ(bench.exciter.sets.size(), 2u) << "gentle and full level";
  EXPECT_EQ(bench.exciter.sets.back().amplitude, 4.0);
  EXPECT_FALSE(bench.outlet.all<protocol::CycleDocument>().back().ordered.has_value());
}

TEST(EngineTrim, IsOffWhereTheRigFileSaysSo) {
  auto rig = bench_rig();
  rig.limits.trim_max_fraction = 0.0;
  EngineBench bench(rig);
  bench.exciter.moves_part = 0.85;
  ASSERT_TRUE(bench.measuring());
  EXPECT_EQ(bench.exciter.sets.back().amplitude, 4.0);
}

// An accelerometer that loses its gain makes the order rise: at most to the bound, and a detector
// that looks at what is asked for ends the motion.
TEST(EngineTrim, GivesAnAccelerometerThatLiesNoMoreThanTheBound) {
  EngineBench bench;
  auto campaign = bench_campaign(1, 100000);
  campaign.settle_cycles_max = 100000;  // the stroke creeps with the order
  ASSERT_TRUE(bench.measuring(campaign));
  const auto highest_order = [&] {
    return std::ranges::max(bench.exciter.sets, {}, &drivers::Setpoint::amplitude).amplitude;
  };
  for (int i = 0; i < 200 && bench.engine.state() != State::fault; ++i) {
    bench.excitation_gain -= 0.002;
    bench.run(1.0);
  }
  EXPECT_LE(highest_order(), 4.0 * 1.25);
  ASSERT_TRUE(bench.run_until(State::fault, 10.0)) << bench.engine.state_document().reason;
  EXPECT_EQ(bench.outlet.alarms("command_error"), 1);
  EXPECT_EQ(bench.outlet.alarms("trim_limited"), 1);
}

TEST(EngineTrim, RampsDownFromATrimmedOrderAlongTheRamp) {
  EngineBench bench;
  bench.exciter.moves_part = 0.9;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  EXPECT_NEAR(bench.exciter.sets.back().amplitude, 4.0 / 0.9, 0.01);
  ASSERT_TRUE(bench.engine.stop("anna").ok());
  EXPECT_EQ(bench.exciter.sets.back().amplitude, 0.0);
  EXPECT_EQ(bench.exciter.sets.back().ramp_s, 0.5);
  ASSERT_TRUE(bench.run_until(State::idle, 3.0));
}

// What a drive reports of a weak table does not keep the ramp from its end.
TEST(EngineTrim, TakesADriveThatReportsTheWeakMotion) {
  EngineBench bench;
  bench.exciter.moves_part = 0.85;
  bench.exciter.admits = true;
  ASSERT_TRUE(bench.measuring());
  EXPECT_NEAR(bench.exciter.sets.back().amplitude, 4.0 / 0.85, 0.01);
}

TEST(EngineTrim, LeavesATableAloneThatDoesWhatItIsTold) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring(bench_campaign(1, 1000)));
  bench.run(60.0);
  EXPECT_LE(bench.exciter.sets.size(), 3u) << "gentle, full, and one for the noise at most";
  EXPECT_EQ(bench.outlet.alarms("amplitude_trimmed"), 0);
}

}  // namespace
}  // namespace shaker::daemon
