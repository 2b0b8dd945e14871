#include "daemon/service/supervision.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr Nanoseconds kNow = 1h;
const Progress kAllWell{kNow, kNow, kNow, std::nullopt, kNow, true};

TEST(Supervision, PingsWhileEverythingAdvancesOrIsIdle) {
  EXPECT_EQ(stuck(kAllWell, kNow), "");
  Progress idle = kAllWell;
  idle.recorder = 0s;  // long ago, and nothing to write
  EXPECT_EQ(stuck(idle, kNow), "");
  Progress busy = kAllWell;
  busy.estimator_busy = kNow - 100ms;
  EXPECT_EQ(stuck(busy, kNow), "");
}

TEST(Supervision, NamesTheOneThatIsStuck) {
  Progress progress = kAllWell;
  progress.acquisition = kNow - 6s;
  EXPECT_THAT(stuck(progress, kNow), HasSubstr("acquisition"));
  progress = kAllWell;
  progress.exciter = kNow - 6s;
  EXPECT_THAT(stuck(progress, kNow), HasSubstr("exciter"));
  progress = kAllWell;
  progress.engine = kNow - 3s;
  EXPECT_THAT(stuck(progress, kNow), HasSubstr("engine"));
  progress = kAllWell;
  progress.estimator_busy = kNow - 61s;
  EXPECT_THAT(stuck(progress, kNow), HasSubstr("estimator"));
  progress = kAllWell;
  progress.recorder = kNow - 21s;
  progress.recorder_idle = false;
  EXPECT_THAT(stuck(progress, kNow), HasSubstr("recorder"));
}

TEST(Supervision, EndsTheMotionWhileAnEstimatorIsStuckAndTheWatchdogStillWaits) {
  const auto after = [](Nanoseconds busy) {
    return must_end({.clients = kNow, .estimator_busy = kNow - busy}, kNow);
  };
  EXPECT_FALSE(must_end({.clients = kNow, .estimator_busy = std::nullopt}, kNow));
  EXPECT_FALSE(after(10s));
  ASSERT_TRUE(after(10s + 1ms));
  EXPECT_EQ(after(11s)->code, "estimator_stuck");
  EXPECT_THAT(after(11s)->why, HasSubstr("the cycles are on disk"));
  // A ramp takes up to 25.5 s, and the confirmation of its end some more.
  Progress progress = kAllWell;
  progress.estimator_busy = kNow - 10s - 28s;
  EXPECT_EQ(stuck(progress, kNow), "");
}

TEST(Supervision, EndsTheMotionWhenNobodyCouldStopIt) {
  const auto after = [](Nanoseconds silence) {
    return must_end({.clients = kNow - silence, .estimator_busy = std::nullopt}, kNow);
  };
  EXPECT_FALSE(after(1s));
  ASSERT_TRUE(after(1s + 1ms));
  EXPECT_EQ(after(2s)->code, "clients_unheard");
}

TEST(Supervision, WaitsForAsLongAsItSays) {
  const auto at = [](Nanoseconds Progress::*who, Nanoseconds ago) {
    Progress progress = kAllWell;
    progress.recorder_idle = false;
    progress.*who = kNow - ago;
    return stuck(progress, kNow);
  };
  const std::pair<Nanoseconds Progress::*, Nanoseconds> bounds[] = {{&Progress::acquisition, 5s},
                                                                    {&Progress::engine, 2s},
                                                                    {&Progress::exciter, 5s},
                                                                    {&Progress::recorder, 20s}};
  for (const auto& [who, bound] : bounds) {
    EXPECT_EQ(at(who, bound), "");
    EXPECT_NE(at(who, bound + 1ns), "");
  }
}

}  // namespace
}  // namespace shaker::daemon
