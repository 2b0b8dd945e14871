#include "daemon/publish/recorder.hpp"

#include <atomic>

#include <nlohmann/json.hpp>
#include <sys/mount.h>

#include "tests/daemon/publish/slow_disk.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using record::CampaignReader;
using record::testing::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

config::CampaignSpec campaign() {
  config::CampaignSpec spec;
  spec.name = "two dwells";
  spec.model.name = "oleo";
  config::EffectSpec orifice;
  orifice.effect = "orifice_damping";
  orifice.parameters["theta1"].start = 16.0;
  spec.model.effects = {orifice};
  spec.runs = {{"r01", 2.0, 3.0, 5}, {"r02", 2.5, 3.5, 6}};
  return spec;
}

std::vector<drivers::Sample> samples(int from, int count) {
  std::vector<drivers::Sample> all;
  for (int i = from; i < from + count; ++i) {
    all.push_back({i * 1ms, 0.25 * i, protocol::Channel::excitation, drivers::Quality::suspect});
  }
  return all;
}

protocol::StateDocument state(const char* name, const char* reason) {
  protocol::StateDocument document;
  document.state = name;
  document.reason = reason;
  return document;
}

protocol::CycleDocument cycle_document() {
  return {"two dwells", "r01", 0, true, "", 2, 3, 0, 0.1, 1, 0, 500, 0, {}};
}

class RecorderTest : public ::testing::Test {
 protected:
  std::unique_ptr<Recorder> make() {
    return std::make_unique<Recorder>(
        RecorderOptions{scratch.path(), "rig A"}, clock, [this] { ++woken; },
        [](protocol::HealthDocument& health) { health.log_drops = 77; });
  }
  // Waits until the recorder has written everything, and returns the published lines.
  std::vector<PublishedLine> settle(Recorder& recorder) {
    for (int i = 0; i < 5000 && !recorder.idle(); ++i)
      clock.sleep_until(clock.now() + 1ms);
    EXPECT_TRUE(recorder.idle());
    auto lines = recorder.take();
    for (auto& line : lines)
      all.push_back(line);
    return lines;
  }
  std::filesystem::path only_file() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
      if (entry.path().extension() == ".db") files.push_back(entry.path());
    }
    EXPECT_EQ(files.size(), 1U);
    return files.empty() ? "" : files.front();
  }

  Scratch scratch;
  RealClock clock;  // a thread waits on it
  std::atomic<int> woken = 0;
  std::vector<PublishedLine> all;
};

TEST_F(RecorderTest, ShowsTheCyclesThatWereNotAccepted) {
  WaveBox waves;
  Recorder recorder({.directory = scratch.path(), .rig = "rig A", .waves = &waves}, clock, [] {},
                    {});
  ASSERT_TRUE(recorder.record_campaign(campaign()));
  ASSERT_TRUE(recorder.record_run(0, campaign().runs[0]));
  ASSERT_TRUE(recorder.record_cycle({0, 4, 2.0, 3.0, {0.1, 0.2}, {3.0, -3.0}}, false));
  ASSERT_TRUE(recorder.record_cycle({0, 5, 2.0, 3.0, {0.3, 0.4}, {3.0, -3.0}}, true));
  settle(recorder);
  const auto seen = waves.take();
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen.front().cycle, 4);
  EXPECT_FALSE(seen.front().accepted);
  EXPECT_THAT(seen.front().stroke_m, ElementsAre(0.1, 0.2));
  EXPECT_THAT(seen.front().excitation_m_s2, ElementsAre(3.0, -3.0));
}

TEST_F(RecorderTest, KeepsACampaignWholeAndInOrder) {
  auto recorder = make();
  ASSERT_TRUE(recorder->publish(state("IDLE", "Started.")));
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  ASSERT_TRUE(recorder->record_samples(samples(0, 3)));
  for (int run = 0; run < 2; ++run) {
    ASSERT_TRUE(recorder->record_run(run, campaign().runs[static_cast<std::size_t>(run)]));
    ASSERT_TRUE(recorder->record_samples(samples(10 * run, 10)));
    ASSERT_TRUE(recorder->record_cycle({run, 0, 2.0, 3.0, {0.1, 0.2}, {3.0, -3.0}}, run == 0));
    ASSERT_TRUE(recorder->publish(cycle_document()));
    ASSERT_TRUE(
        recorder->publish(protocol::RunStopDocument{"two dwells", "r", "success", "", 1, 0}));
  }
  recorder->close_campaign();
  ASSERT_TRUE(recorder->publish(state("IDLE", "Done.")));
  settle(*recorder);

  ASSERT_EQ(all.size(), 6U);
  EXPECT_GT(woken, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].seq, i + 1);
    EXPECT_EQ(json::parse(all[i].text)["seq"], i + 1);
    EXPECT_EQ(json::parse(all[i].text)["type"], all[i].type);
  }
  const auto reader = CampaignReader::open(only_file());
  ASSERT_TRUE(reader) << reader.error().what;
  const auto row = reader->campaign();
  EXPECT_EQ(row->status, "success");
  EXPECT_EQ(row->rig, "rig A");
  EXPECT_EQ(reader->samples(-1)->size(), 3U);
  const auto second = reader->samples(1);
  ASSERT_EQ(second->size(), 10U);
  EXPECT_EQ((*second)[4].t_ns, 14'000'000);
  EXPECT_EQ((*second)[4].value, 3.5);
  EXPECT_EQ((*second)[4].channel, protocol::Channel::excitation);
  EXPECT_EQ((*second)[4].quality, 1);
  EXPECT_TRUE((*reader->cycles(0))[0].accepted);
  EXPECT_FALSE((*reader->cycles(1))[0].accepted);
  // Exactly the documents of the campaign.
  EXPECT_THAT(*reader->documents(),
              ElementsAre(all[1].text, all[2].text, all[3].text, all[4].text));
}

TEST_F(RecorderTest, KeepsWhereTheNumbersComeFrom) {
  Recorder recorder(
      {.directory = scratch.path(), .rig = "rig A", .facts = {{"host", "name", "pc"}}}, clock,
      [] {}, {});
  auto spec = campaign();
  spec.specimen.serial = "N-042";
  spec.resumes = "earlier.db";
  ASSERT_TRUE(recorder.prepare(spec, "anna (pid 7)"));
  ASSERT_TRUE(recorder.record_campaign(spec));
  ASSERT_TRUE(recorder.publish(state("RAMP_DOWN", "stopped by otto (pid 8)")));
  recorder.close_campaign();
  settle(recorder);
  const auto facts = CampaignReader::open(only_file())->facts();
  ASSERT_TRUE(facts) << facts.error().what;
  const auto row = CampaignReader::open(only_file())->campaign();
  std::vector<std::string> found;
  for (const record::Fact& fact : *facts) {
    if (fact.name == "sha256") {
      EXPECT_EQ(fact.value,
                record::sha256(fact.kind == "model" ? row->model_json : row->spec_json));
    } else {
      found.push_back(fact.kind + " " + fact.name + ": " + fact.value);
    }
  }
  EXPECT_EQ(facts->size(), found.size() + 2) << "of campaign and model";
  EXPECT_THAT(found, ElementsAre("host name: pc", "person started by: anna (pid 7)",
                                 "campaign resumes: earlier.db", "specimen serial: N-042",
                                 "person ended because: stopped by otto (pid 8)"));
}

TEST_F(RecorderTest, KeepsTheCampaignAsAFileThatCanBeStartedAgain) {
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  recorder->close_campaign();
  settle(*recorder);
  const auto row = CampaignReader::open(only_file())->campaign();
  const auto again = config::parse_campaign(row->spec_json, "recorded", "/");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->name, "two dwells");
  ASSERT_EQ(again->runs.size(), 2U);
  EXPECT_EQ(again->runs[1].frequency_hz, 2.5);
  EXPECT_EQ(again->runs[1].cycles, 6);
  EXPECT_EQ(again->model.effects.front().parameters.at("theta1").start, 16.0);
  EXPECT_EQ(row->status, "abort");  // no run has ended
}

TEST_F(RecorderTest, PublishesNothingThatIsNotOnDisk) {
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  ASSERT_TRUE(recorder->record_run(0, campaign().runs[0]));
  const auto file = only_file();
  std::uint64_t seen = 0;
  for (int i = 0; i < 5000 && seen < 100; ++i) {
    ASSERT_TRUE(recorder->record_cycle({0, i, 2.0, 3.0, {0.1}, {}}, true));
    ASSERT_TRUE(recorder->publish(cycle_document()));
    const auto lines = recorder->take();
    clock.sleep_until(clock.now() + 1ms);
    if (lines.empty()) continue;
    seen += lines.size();
    // Another process reads the file at this moment.
    const auto reader = CampaignReader::open(file);
    ASSERT_TRUE(reader) << reader.error().what;
    EXPECT_GE(reader->documents()->size(), seen);
    EXPECT_GE(reader->cycles(0)->size(), seen);
  }
  EXPECT_GE(seen, 100U);
}

TEST_F(RecorderTest, EndsTheCampaignAsItsWorstRunDid) {
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  for (const char* status : {"success", "fail", "abort", "success"}) {
    ASSERT_TRUE(recorder->publish(protocol::RunStopDocument{"two dwells", "r", status, "", 1, 0}));
  }
  recorder->close_campaign();
  settle(*recorder);
  EXPECT_EQ(CampaignReader::open(only_file())->campaign()->status, "fail");
}

TEST_F(RecorderTest, CompletesTheHealthDocument) {
  auto recorder = make();
  ASSERT_TRUE(recorder->publish(protocol::HealthDocument{}));
  const auto lines = settle(*recorder);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(json::parse(lines[0].text)["log_drops"], 77);
  EXPECT_TRUE(json::parse(lines[0].text).contains("disk_flush_max_s"));
}

struct Unmounted {
  const Scratch& scratch;
  ~Unmounted() { ::umount2(scratch.path().c_str(), MNT_DETACH); }
};

TEST_F(RecorderTest, OnAFullDiskSaysSoAndWithholdsWhatItCannotKeep) {
  if (::mount("tmpfs", scratch.path().c_str(), "tmpfs", 0, "size=300k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  const Unmounted after{scratch};
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  Result<void> outcome;
  int published = 0;
  for (; published < 1000 && outcome; ++published) {
    ASSERT_TRUE(recorder->record_samples(samples(0, 100)) || published > 0);
    outcome = recorder->publish(cycle_document());
    settle(*recorder);
  }
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().what, HasSubstr("the disk is full"));
  EXPECT_FALSE(recorder->record_samples(samples(0, 1)));
  EXPECT_FALSE(recorder->publish(state("RAMP_DOWN", "The disk is full.")));
  settle(*recorder);

  const auto reader = CampaignReader::open(only_file());
  ASSERT_TRUE(reader) << reader.error().what;
  std::size_t cycles = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].seq, i + 1);  // still without a gap
    cycles += all[i].type == "cycle" ? 1 : 0;
  }
  EXPECT_LT(cycles, static_cast<std::size_t>(published));
  EXPECT_GE(reader->documents()->size(), cycles);
  EXPECT_FALSE(recorder->healthy());  // then the engine reports it
  EXPECT_EQ(all.back().type, "state");
  recorder.reset();
}

TEST_F(RecorderTest, SendsWhatNeedNotBeKeptPastADiskThatHangs) {
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  ASSERT_TRUE(recorder->publish(cycle_document()));
  settle(*recorder);
  ASSERT_EQ(all.size(), 1U);
  testing::hang_the_disk(true);
  const Nanoseconds begin = clock.now();
  ASSERT_TRUE(recorder->publish(cycle_document()));
  ASSERT_TRUE(recorder->publish(state("MEASURE", "Behind the disk.")));
  clock.sleep_until(clock.now() + 100ms);  // the state is being written, or in the queue
  ASSERT_TRUE(recorder->publish(state("MEASURE", "In the queue.")));
  while (recorder->healthy() && clock.now() - begin < 10s)
    clock.sleep_until(clock.now() + 5ms);
  EXPECT_GE(clock.now() - begin, 1s);  // the disk is not given up early
  EXPECT_FALSE(recorder->healthy());
  EXPECT_THAT(recorder->healthy().error().what, HasSubstr("the disk has not answered for 1.0 s"));
  EXPECT_FALSE(recorder->publish(state("RAMP_DOWN", "The disk hangs.")));
  EXPECT_FALSE(recorder->publish(cycle_document()));  // it cannot be stored
  EXPECT_FALSE(recorder->record_campaign(campaign()));
  auto lines = recorder->take();
  ASSERT_EQ(lines.size(), 3U);
  for (const auto& line : lines)
    EXPECT_EQ(line.type, "state");
  EXPECT_THAT(lines[0].text, HasSubstr("Behind the disk."));
  EXPECT_THAT(lines[1].text, HasSubstr("In the queue."));
  EXPECT_GT(lines[0].seq, all[0].seq);
  EXPECT_GT(lines[2].seq, lines[1].seq);
  testing::hang_the_disk(false);
  settle(*recorder);
  EXPECT_EQ(all.size(), 1U);  // lines that the disk wrote too late are in the file only

  recorder->close_campaign();
  settle(*recorder);
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  EXPECT_TRUE(recorder->healthy());
  ASSERT_TRUE(recorder->publish(cycle_document()));
  settle(*recorder);
  EXPECT_GT(all.back().seq, lines[2].seq);
}

// Cycles behind a disk that hangs take memory as samples do.
TEST_F(RecorderTest, CountsTheCyclesThatWaitAgainstWhatMayWait) {
  RecorderOptions options{scratch.path(), "rig A"};
  options.max_waiting = 10'000;
  Recorder recorder(options, clock, [] {}, {});
  ASSERT_TRUE(recorder.record_campaign(campaign()));
  ASSERT_TRUE(recorder.record_run(0, campaign().runs[0]));
  settle(recorder);
  testing::hang_the_disk(true);
  const estimator::MeasuredCycle cycle{0, 0, 2.0, 3.0, std::vector<double>(2000, 0.1), {}};
  Result<void> told;
  for (int i = 0; i < 20 && told; ++i) {  // the first ones may go to the disk that hangs
    EXPECT_TRUE(recorder.record_cycle(cycle, true));
    told = recorder.record_samples(samples(0, 1));
    clock.sleep_until(clock.now() + 20ms);
  }
  testing::hang_the_disk(false);
  ASSERT_FALSE(told);
  EXPECT_THAT(told.error().what, HasSubstr("the disk does not keep up"));
}

TEST_F(RecorderTest, AcknowledgesNothingThatIsInNoFile) {
  auto recorder = make();
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  ASSERT_TRUE(recorder->publish(cycle_document()));
  settle(*recorder);
  ASSERT_EQ(all.size(), 1U);
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path()))
    std::filesystem::remove(entry.path());
  ASSERT_TRUE(recorder->publish(cycle_document()));
  settle(*recorder);
  EXPECT_EQ(all.size(), 1U);
  EXPECT_FALSE(recorder->healthy());
}

TEST_F(RecorderTest, TakesAPreparedFileOrRemovesIt) {
  auto recorder = make();
  ASSERT_TRUE(recorder->prepare(campaign()));
  const auto file = only_file();
  recorder->discard();
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
  ASSERT_TRUE(recorder->prepare(campaign()));
  ASSERT_TRUE(recorder->record_campaign(campaign()));
  only_file();
}

TEST_F(RecorderTest, RefusesACampaignThatCannotBeKept) {
  Recorder recorder({"/proc/no such place", "rig A"}, clock, [] {}, {});
  const auto outcome = recorder.record_campaign(campaign());
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().what, HasSubstr("/proc/no such place"));
}

}  // namespace
}  // namespace shaker::daemon
