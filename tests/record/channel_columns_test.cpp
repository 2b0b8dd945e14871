#include "record/channel_columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "record/accepted_cycles.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using protocol::Channel;

constexpr double kHertz = 4.0, kRate = 250.0;

double wave(double t, int harmonic) {
  return std::cos(2.0 * std::numbers::pi * kHertz * harmonic * t + 0.3);
}

SampleRow sample(double t, double value, Channel channel) {
  return {static_cast<std::int64_t>(std::llround(1e9 * t)) + 1'700'000'000'000'000'000, value,
          channel, 0};
}

// Four channels of one device, and the load cell of another, a third of a step later.
std::vector<SampleRow> recorded(double seconds, double force_from = 0.0) {
  std::vector<SampleRow> rows;
  for (int i = 0; i < static_cast<int>(seconds * kRate); ++i) {
    const double t = i / kRate, late = t + 1.0 / (3.0 * kRate);
    rows.push_back(sample(t, wave(t, 1), Channel::displacement));
    rows.push_back(sample(t, wave(t, 2), Channel::excitation));
    rows.push_back(sample(t, wave(t, 3), Channel::acceleration));
    rows.push_back(sample(t, 21.5, Channel::aux1));
    if (t >= force_from) rows.push_back(sample(late, wave(late, 3), Channel::force));
  }
  return rows;
}

constexpr Channel kAll[] = {Channel::displacement, Channel::acceleration, Channel::force};

TEST(ChannelColumns, AreOnTheTimesOfTheFirstChannel) {
  const ChannelColumns columns = channel_columns(recorded(1.0, 0.1), kAll);
  ASSERT_EQ(columns.values.size(), 3u);
  ASSERT_EQ(columns.t.size(), 224u);  // from the load cell's first sample on
  const double begin = 0.104;
  for (std::size_t i = 0; i < columns.t.size(); ++i) {
    const double t = begin + columns.t[i];
    ASSERT_NEAR(columns.t[i], static_cast<double>(i) / kRate, 1e-9);
    ASSERT_NEAR(columns.values[0][i], wave(t, 1), 1e-9);
    ASSERT_NEAR(columns.values[1][i], wave(t, 3), 1e-9) << "as it was sampled";
    // The third harmonic has 21 samples in a period: linear interpolation would be off by 1e-2.
    ASSERT_NEAR(columns.values[2][i], wave(t, 3), 1e-4) << "between samples, " << i;
  }
}

TEST(ChannelColumns, AreNoneWithoutAChannel) {
  EXPECT_TRUE(channel_columns({}, kAll).t.empty());
  EXPECT_TRUE(channel_columns(recorded(1.0, 0.95), kAll).t.empty()) << "12 samples of the force";
}

TEST(ChannelColumns, SamplesThatComeTwiceOrLateAreLeftOut) {
  auto rows = recorded(1.0);
  rows.insert(rows.begin() + 400, rows.begin() + 200, rows.begin() + 210);
  const ChannelColumns twice = channel_columns(rows, kAll),
                       once = channel_columns(recorded(1.0), kAll);
  EXPECT_EQ(twice.t, once.t);
  EXPECT_EQ(twice.values, once.values);
}

// A campaign with one run of three cycles and slightly more than a second of raw samples.
std::filesystem::path written(const std::filesystem::path& folder, bool all_channels) {
  auto writer = CampaignWriter::create(folder, testing::example_campaign());
  EXPECT_TRUE(writer) << writer.error().what;
  EXPECT_TRUE(writer->add_run({0, "r01", kHertz, 2.0, 3}));
  auto rows = recorded(100.0);
  if (!all_channels) {
    std::erase_if(rows, [](const SampleRow& row) {
      return row.channel == Channel::acceleration || row.channel == Channel::force;
    });
  }
  EXPECT_TRUE(writer->add_samples(0, rows));
  for (int k = 0; k < 3; ++k)
    EXPECT_TRUE(
        writer->add_cycle({0, k, true, kHertz, 2.0, std::vector<double>(32, 0.5), {}, 0.0}));
  EXPECT_TRUE(writer->commit());
  return writer->file();
}

TEST(LastSamples, AreOfTheEndAndNoMoreThanABlockTooMany) {
  const testing::Scratch scratch;
  const auto reader = CampaignReader::open(written(scratch.path(), true));
  ASSERT_TRUE(reader);
  const auto all = reader->samples(0), last = reader->last_samples(0, 2.0);
  ASSERT_TRUE(all && last);
  EXPECT_EQ(last->back().t_ns, all->back().t_ns);
  EXPECT_LE(last->front().t_ns, all->back().t_ns - 2'000'000'000);
  EXPECT_LE(last->size(), 2 * 5 * kRate + 2 * 4096);
  const auto tail = std::span(*all).last(last->size());
  EXPECT_TRUE(std::ranges::equal(*last, tail, {}, &SampleRow::t_ns, &SampleRow::t_ns));
}

TEST(LastSamples, AreAllOfThemWhereADamagedFileAsksForMoreThanTimeCanTell) {
  const testing::Scratch scratch;
  const auto reader = CampaignReader::open(written(scratch.path(), true));
  ASSERT_TRUE(reader);
  const auto all = reader->samples(0), last = reader->last_samples(0, 8e148);
  ASSERT_TRUE(all && last);
  EXPECT_EQ(last->size(), all->size());
}

TEST(ChannelColumns, TakeTimesThatLieFurtherApartThanTheyCanCount) {
  constexpr auto kFar = std::numeric_limits<std::int64_t>::max();
  std::vector<SampleRow> samples;
  for (const std::int64_t t_ns : {-kFar, std::int64_t{0}, std::int64_t{1}, std::int64_t{2}, kFar})
    samples.push_back({t_ns, 1.0, protocol::Channel::displacement});
  const std::vector wanted = {protocol::Channel::displacement};
  for (const double t : channel_columns(samples, wanted).t)
    EXPECT_TRUE(std::isfinite(t));
}

TEST(AcceptedCycles, AreRawSamplesWhereOtherChannelsWereRecorded) {
  const testing::Scratch scratch;
  const auto reader = CampaignReader::open(written(scratch.path(), true));
  ASSERT_TRUE(reader);
  const auto runs = accepted_cycles(*reader);
  ASSERT_TRUE(runs) << runs.error().what;
  const AcceptedCycles& run = runs->front();
  EXPECT_GE(run.t.back() - run.t.front(), 3.0 / kHertz - 2.0 / kRate);
  EXPECT_EQ(run.displacement.size(), run.t.size());
  EXPECT_EQ(run.excitation.size(), run.t.size());
  EXPECT_EQ(run.acceleration.size(), run.t.size());
  EXPECT_EQ(run.force.size(), run.t.size());
  EXPECT_NEAR(run.force[40], run.acceleration[40], 1e-4) << "both are the same wave";
}

TEST(AcceptedCycles, AreTheCyclesWhereThereIsNoOtherChannel) {
  const testing::Scratch scratch;
  const auto reader = CampaignReader::open(written(scratch.path(), false));
  ASSERT_TRUE(reader);
  const auto runs = accepted_cycles(*reader);
  ASSERT_TRUE(runs) << runs.error().what;
  EXPECT_EQ(runs->front().t.size(), 96u);
  EXPECT_EQ(runs->front().displacement, std::vector<double>(96, 0.5));
  EXPECT_TRUE(runs->front().acceleration.empty());
  EXPECT_TRUE(runs->front().force.empty());
}

}  // namespace
}  // namespace shaker::record
