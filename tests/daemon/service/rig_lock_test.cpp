#include "daemon/service/rig_lock.hpp"

#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using record::testing::Scratch;
using ::testing::HasSubstr;

class RigLockTest : public ::testing::Test {
 protected:
  RigLockTest() {
    // An address for documentation (RFC 5737), which neither this PC nor another test has.
    config::ModbusExciter exciter;
    exciter.link.transport = config::ModbusTcp{fmt::format("203.0.113.{}", ::getpid() % 250 + 1),
                                               ::getpid() / 250 % 65000 + 1};
    moving.exciter.device = exciter;
    simulated.exciter.device = config::SimulatedExciter{};
  }
  Result<RigLock> take(const config::RigConfig& rig, const std::filesystem::path& folder) {
    return RigLock::take(rig, folder, place, [](const std::string&) {});
  }

  Scratch scratch;
  config::RigConfig moving, simulated;
  std::filesystem::path data = scratch.path() / "made" / "data",
                        other_data = scratch.path() / "more";
  LockPlace place{scratch.path(), false, {}};
};

TEST_F(RigLockTest, RefusesASecondDaemonOnTheSameExciterWhateverItsFilesAre) {
  auto first = take(moving, data);
  ASSERT_TRUE(first) << first.error().what;
  const auto second = take(moving, other_data);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().what, HasSubstr("203.0.113."));
  EXPECT_THAT(second.error().what, HasSubstr("drives this exciter"));
}

TEST_F(RigLockTest, LetsDaemonsWhoseDevicesMoveNothingRunSideBySide) {
  auto first = take(simulated, data);
  ASSERT_TRUE(first);
  EXPECT_TRUE(take(simulated, other_data));
}

TEST_F(RigLockTest, RefusesASecondDaemonOnTheSameData) {
  auto first = take(simulated, data);
  ASSERT_TRUE(first);
  const auto second = take(simulated, data);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().what, HasSubstr("records in this directory"));
}

// The group that commands the rig may read the directory, and so lock it.
TEST_F(RigLockTest, IsNotKeptByWhoOnlyMayReadTheDirectory) {
  ASSERT_TRUE(take(simulated, data));  // makes it
  const UniqueFd reader(::open(data.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(::flock(reader.get(), LOCK_EX | LOCK_NB), 0);
  EXPECT_TRUE(take(simulated, data));
  EXPECT_EQ(std::filesystem::status(data / ".lock").permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(RigLockTest, EndsWithItsHolder) {
  auto taken = take(moving, data);
  ASSERT_TRUE(taken);
  std::optional<RigLock> held = std::move(*taken);
  held.reset();
  EXPECT_TRUE(take(moving, data));
}

}  // namespace
}  // namespace shaker::daemon
