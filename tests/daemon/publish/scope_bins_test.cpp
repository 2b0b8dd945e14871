#include "daemon/publish/scope_bins.hpp"

#include <limits>

#include <gmock/gmock.h>

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::Quality;
using protocol::Channel;
using ::testing::ElementsAre;

TEST(ScopeBins, HoldTheExtremesOfEachBinAndChannel) {
  ScopeBins bins;
  const drivers::Sample samples[] = {
      {100ms, 1.0, Channel::displacement, Quality::good},
      {101ms, 7.0, Channel::excitation, Quality::good},
      {119ms, -2.0, Channel::displacement, Quality::suspect},
      {120ms, 3.0, Channel::displacement, Quality::good},
      {141ms, 4.0, Channel::displacement, Quality::good},
  };
  bins.add(samples);
  const auto document = bins.take(1s);
  ASSERT_TRUE(document);
  EXPECT_EQ(document->bin_s, 0.02);
  ASSERT_EQ(document->channels.size(), 1U);  // the other channel's bin is still open
  EXPECT_EQ(document->channels[0].channel, "displacement");
  EXPECT_THAT(document->channels[0].bin, ElementsAre(5, 6));
  EXPECT_THAT(document->channels[0].smallest, ElementsAre(-2.0, 3.0));
  EXPECT_THAT(document->channels[0].largest, ElementsAre(1.0, 3.0));
}

TEST(ScopeBins, LeaveOutWhatIsBadOrLate) {
  ScopeBins bins;
  const drivers::Sample samples[] = {
      {100ms, 1.0, Channel::force, Quality::good},
      {101ms, 99.0, Channel::force, Quality::bad},
      {102ms, std::numeric_limits<double>::quiet_NaN(), Channel::force, Quality::good},
      {120ms, 2.0, Channel::force, Quality::good},
      {103ms, 50.0, Channel::force, Quality::good},
      {140ms, 2.0, Channel::force, Quality::good},
  };
  bins.add(samples);
  const auto document = bins.take(1s);
  ASSERT_TRUE(document);
  EXPECT_THAT(document->channels[0].largest, ElementsAre(1.0, 2.0));
}

TEST(ScopeBins, SpeakTenTimesASecondAndOnlyOfNews) {
  ScopeBins bins;
  int documents = 0;
  std::size_t seen = 0;
  for (int t = 0; t < 1000; ++t) {
    const drivers::Sample sample{t * 1ms, 1.0, Channel::displacement, Quality::good};
    bins.add({&sample, 1});
    if (const auto document = bins.take(t * 1ms)) {
      ++documents;
      seen += document->channels[0].bin.size();
    }
  }
  EXPECT_GE(documents, 9);
  EXPECT_LE(documents, 10);
  EXPECT_GE(seen, 44U);  // of 50 bins
  EXPECT_TRUE(bins.take(2s));
  EXPECT_FALSE(bins.take(3s));
}

TEST(ScopeBins, NeverGrowWithoutBound) {
  ScopeBins bins;
  for (int t = 0; t < 100'000; ++t) {
    const drivers::Sample sample{t * 20ms, 1.0, Channel::displacement, Quality::good};
    bins.add({&sample, 1});
  }
  EXPECT_EQ(bins.take(1s)->channels[0].bin.size(), ScopeBins::kMaxBins);
}

}  // namespace
}  // namespace shaker::daemon
