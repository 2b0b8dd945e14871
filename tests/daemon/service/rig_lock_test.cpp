#include "daemon/service/rig_lock.hpp"

#include <fstream>
#include <optional>

#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using record::testing::Scratch;
using ::testing::HasSubstr;

class RigLockTest : public ::testing::Test {
 protected:
  RigLockTest() {
    std::ofstream(rig) << "{}";
    std::ofstream(other_rig) << "{}";
  }
  Scratch scratch;
  std::filesystem::path rig = scratch.path() / "rig.json",
                        other_rig = scratch.path() / "other.json";
  std::filesystem::path data = scratch.path() / "made" / "data",
                        other_data = scratch.path() / "more";
};

TEST_F(RigLockTest, RefusesASecondDaemonOnTheSameRigAndNamesIt) {
  auto first = RigLock::take(rig, data);
  ASSERT_TRUE(first) << first.error().what;
  const auto second = RigLock::take(rig, other_data);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().what, HasSubstr(rig.string()));
  EXPECT_THAT(second.error().what, HasSubstr("another shakerd drives this rig"));
}

TEST_F(RigLockTest, RefusesASecondDaemonOnTheSameData) {
  auto first = RigLock::take(rig, data);
  ASSERT_TRUE(first);
  const auto second = RigLock::take(other_rig, data);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, HasSubstr("records in this directory"));
}

TEST_F(RigLockTest, EndsWithItsHolder) {
  auto taken = RigLock::take(rig, data);
  ASSERT_TRUE(taken);
  std::optional<RigLock> held = std::move(*taken);
  held.reset();
  EXPECT_TRUE(RigLock::take(rig, data));
}

TEST_F(RigLockTest, NamesARigFileThatIsNotThere) {
  const auto lock = RigLock::take(scratch.path() / "missing.json", data);
  ASSERT_FALSE(lock);
  EXPECT_THAT(lock.error().what, HasSubstr("missing.json"));
}

}  // namespace
}  // namespace shaker::daemon
