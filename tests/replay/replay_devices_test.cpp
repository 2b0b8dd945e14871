#include <array>
#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/factory.hpp"
#include "drivers/replay/replay_exciter.hpp"
#include "drivers/replay/replay_sensor.hpp"
#include "record/campaign_database.hpp"

namespace shaker::drivers::replay {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using testing::HasSubstr;

// A folder for this test alone, removed at the end.
class ReplayDevices : public testing::Test {
 protected:
  ReplayDevices() {
    std::string name = testing::TempDir() + "replay_XXXXXX";
    folder_ = ::mkdtemp(name.data());
  }
  ~ReplayDevices() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  config::ReplaySensor log(const std::string& text, double speed = 0.0) {
    config::ReplaySensor config;
    config.file = write("a.log", text);
    config.dbc = SHAKER_TEST_DATA "/can/rig.dbc";
    config.signals = {{Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0}};
    config.speed = speed;
    return config;
  }

  std::filesystem::path folder_;
  SimulatedClock clock_;
  std::array<Sample, 16> out_;
};

constexpr auto kFourFrames =
    "(100.000000) can0 181#010000000000\n(100.010000) can0 181#020000000000\n"
    "(100.030000) can0 181#030000000000\n(101.000000) can0 181#040000000000";

TEST_F(ReplayDevices, GiveSamplesWhenTheyAreDueAtTheSpeedAskedFor) {
  auto sensor = make_replay_sensor(log(kFourFrames, 2.0), "/", clock_);
  ASSERT_TRUE(sensor.ok()) << sensor.error().what;
  clock_.advance(7s);
  ASSERT_TRUE((*sensor)->connect().ok());
  EXPECT_EQ(*(*sensor)->read(out_, 0ns), 1u);
  EXPECT_EQ(out_[0].t, 7s);
  EXPECT_EQ(*(*sensor)->read(out_, 4ms), 0u) << "due after 5 ms";
  EXPECT_EQ(clock_.now(), 7s + 4ms) << "it waits for no longer than it was told to";
  EXPECT_EQ(*(*sensor)->read(out_, 4ms), 1u);
  EXPECT_EQ(clock_.now(), 7s + 5ms);
  EXPECT_EQ(out_[0].t, 7s + 10ms) << "stamps keep their recorded distances";
  clock_.advance(1s);
  EXPECT_EQ(*(*sensor)->read(out_, 0ns), 2u);
  EXPECT_TRUE((*sensor)->finished());
  EXPECT_EQ(*(*sensor)->read(out_, 0ns), 0u);
  EXPECT_EQ((*sensor)->stamp_source(), StampSource::recorded);
}

TEST_F(ReplayDevices, StartAgainWhenConnectedAgain) {
  auto sensor = make_replay_sensor(log(kFourFrames), "/", clock_);
  ASSERT_TRUE(sensor.ok());
  EXPECT_FALSE((*sensor)->read(out_, 0ns).ok()) << "not open yet";
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE((*sensor)->connect().ok());
    EXPECT_EQ(*(*sensor)->read(out_, 0ns), 4u);
    EXPECT_EQ((*sensor)->health().samples, 4u);
    EXPECT_TRUE((*sensor)->finished());
  }
}

TEST_F(ReplayDevices, CountTheReconnectionsOfALogOfPollsAnewEachTime) {
  config::ReplaySensor polls;
  polls.file = write("polls.log",
                     "(1.000000000 1.000000000) connected\n"
                     "(1.010000000 1.011000000) input0#3F800000\n"
                     "(2.000000000 2.000000000) connected\n"
                     "(2.010000000 2.011000000) input0#40000000\n");
  auto& displacement = polls.registers[Channel::displacement];
  displacement.table = protocol::modbus::RegisterTable::input;
  displacement.type = protocol::modbus::RegisterType::f32;
  auto sensor = make_replay_sensor(polls, "/", clock_);
  ASSERT_TRUE(sensor.ok()) << sensor.error().what;
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE((*sensor)->connect().ok());
    ASSERT_EQ(*(*sensor)->read(out_, 0ns), 2u);
    EXPECT_EQ(out_[1].value, 2.0);
    EXPECT_EQ((*sensor)->health().reconnects, 1u);
  }
}

TEST_F(ReplayDevices, AreFinishedAtOnceWithAnEmptyOrForeignLog) {
  for (const std::string& text :
       {std::string(), std::string(100'000, 'x'), std::string("\n\n\n")}) {
    auto sensor = make_replay_sensor(log(text), "/", clock_);
    ASSERT_TRUE(sensor.ok());
    ASSERT_TRUE((*sensor)->connect().ok());
    EXPECT_TRUE((*sensor)->finished());
    EXPECT_EQ(*(*sensor)->read(out_, 0ns), 0u);
  }
}

TEST_F(ReplayDevices, GiveTheSamplesOfACampaignsRunsInTheirOrder) {
  std::filesystem::path file;
  {
    record::CampaignRow campaign;
    campaign.name = "replayed";
    campaign.started_utc = "2026-03-01T12:00:00.000Z";
    auto writer = record::CampaignWriter::create(folder_, campaign);
    ASSERT_TRUE(writer.ok()) << writer.error().what;
    file = writer->file();
    for (int run = 0; run < 2; ++run) {
      ASSERT_TRUE(writer->add_run({run, "r" + std::to_string(run), 2.5, 9.0, 3}).ok());
      const std::int64_t t = 1'000'000'000 * (run + 1);
      const record::SampleRow rows[] = {{t, 0.1 + run, Channel::displacement, 0},
                                        {t + 1000, 5.0, Channel::excitation, 2}};
      ASSERT_TRUE(writer->add_samples(run, rows).ok());
    }
    ASSERT_TRUE(writer->commit().ok());
  }
  config::ReplaySensor config;
  config.file = file;
  auto sensor = make_replay_sensor(config, "/", clock_);
  ASSERT_TRUE(sensor.ok()) << sensor.error().what;
  EXPECT_THAT((*sensor)->channels(),
              testing::ElementsAre(Channel::displacement, Channel::excitation));
  ASSERT_TRUE((*sensor)->connect().ok());
  ASSERT_EQ(*(*sensor)->read(out_, 0ns), 4u);
  EXPECT_EQ(out_[0].t, 0ns);
  EXPECT_EQ(out_[1].t, 1us);
  EXPECT_EQ(out_[1].quality, Quality::bad);
  EXPECT_EQ(out_[2].t, 1s);
  EXPECT_EQ(out_[2].value, 1.1);
  EXPECT_TRUE((*sensor)->finished());
}

TEST_F(ReplayDevices, SayWhatIsWrongWithTheRecording) {
  const auto refusal = [&](const config::ReplaySensor& config) {
    const auto made = make_replay_sensor(config, "/", clock_);
    return made.ok() ? "accepted" : made.error().what;
  };
  auto config = log(kFourFrames);
  config.dbc.clear();
  EXPECT_THAT(refusal(config), HasSubstr("a candump log needs \"dbc\" and \"signals\""));
  config = log(kFourFrames, -1.0);
  EXPECT_THAT(refusal(config), HasSubstr("speed is -1"));
  config.file = "nowhere.log";
  EXPECT_THAT(refusal(config), HasSubstr("there is no recording /nowhere.log"));
  config.file = write("broken.db", std::string("SQLite format 3\0 and rubbish", 28));
  config.speed = 0.0;
  EXPECT_THAT(refusal(config), HasSubstr("broken.db"));
}

TEST_F(ReplayDevices, AreMadeFromARigFile) {
  config::RigConfig rig;
  rig.exciter.device = config::ReplayExciter{};
  rig.sensors = {log(kFourFrames)};
  const auto devices = make_devices(rig, clock_);
  ASSERT_TRUE(devices.ok()) << devices.error().what;
  EXPECT_THAT(devices->sensors.at(0)->description(), HasSubstr("replay of"));
  auto& exciter = *devices->exciter;
  ASSERT_TRUE(exciter.connect().ok());
  ASSERT_TRUE(exciter.write({2.5, 9.0, true, 1.0}).ok());
  EXPECT_TRUE(exciter.read()->running);
  ASSERT_TRUE(exciter.stop().ok());
  EXPECT_FALSE(exciter.read()->running);
}

}  // namespace
}  // namespace shaker::drivers::replay
