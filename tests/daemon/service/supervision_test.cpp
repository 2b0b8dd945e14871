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

}  // namespace
}  // namespace shaker::daemon
