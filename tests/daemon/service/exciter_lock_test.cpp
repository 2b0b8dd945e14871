// Daemons of several users. Where the user matters, each is a separate process; this needs
// root.
#include "daemon/service/exciter_lock.hpp"

#include <atomic>
#include <csignal>
#include <cstring>
#include <future>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr uid_t kStranger = 65534;

void ignore(const std::string&) {}

// The name of the lock, written by independent code.
struct RawName {
  sockaddr_un address{};
  socklen_t size;
  explicit RawName(const std::string& exciter) {
    const std::string name = "shakerd/exciter/" + exciter;
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }
  const sockaddr* get() const {
    const void* generic = &address;
    return static_cast<const sockaddr*>(generic);
  }
};

// A process of another user: runs `work`, reports when it is ready, and returns its exit
// status.
class Stranger {
 public:
  template <class Work>
  explicit Stranger(const Work& work) {
    int ends[2];
    if (::pipe(ends) != 0) std::abort();
    pid_ = ::fork();
    if (pid_ == 0) {
      if (::setgid(kStranger) != 0 || ::setuid(kStranger) != 0) ::_exit(99);
      work([&] { return ::write(ends[1], "x", 1) == 1; });
      ::_exit(98);
    }
    char ready = 0;
    ::close(ends[1]);
    EXPECT_EQ(::read(ends[0], &ready, 1), 1);
    ::close(ends[0]);
  }
  ~Stranger() { end(); }
  int end(int signal = SIGKILL) {
    if (pid_ > 0 && signal != 0) ::kill(pid_, signal);
    int status = 0;
    if (pid_ > 0) ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return status;
  }

 private:
  pid_t pid_ = 0;
};

class ExciterLockTest : public ::testing::Test {
 protected:
  // Permissions as of /run/shakerd: everybody may read.
  ExciterLockTest() { std::filesystem::permissions(scratch.path(), std::filesystem::perms(0755)); }
  auto take(const LockPlace& place, ExciterLock::LetGo let_go = ignore) {
    return ExciterLock::take(address, place, std::move(let_go));
  }
  bool strangers_can_be_made() { return ::geteuid() == 0; }

  record::testing::Scratch scratch;
  const std::string address = fmt::format("test-{}", ::getpid());
  const LockPlace service{scratch.path(), true, 300ms};
  const LockPlace plain{scratch.path(), false, 0ms};
};

TEST_F(ExciterLockTest, RefusesASecondPlainDaemonAndNamesTheFirst) {
  const auto first = take(plain);
  ASSERT_TRUE(first) << first.error().what;
  const auto second = take(plain);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().what, HasSubstr(address));
  EXPECT_THAT(second.error().what, HasSubstr(fmt::format("(pid {}), drives this", ::getpid())));
}

TEST_F(ExciterLockTest, WhoOnlyLooksWhoHasTheExciterEndsNobody) {
  std::atomic<int> asked{0};
  const auto first = take(plain, [&](const std::string&) { ++asked; });
  ASSERT_TRUE(first) << first.error().what;
  for (int i = 0; i < 3; ++i)
    EXPECT_FALSE(take(plain));
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(asked, 0);
}

TEST_F(ExciterLockTest, RefusesASecondService) {
  const auto first = take(service);
  ASSERT_TRUE(first) << first.error().what;
  const auto second = take(service);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
}

TEST_F(ExciterLockTest, RefusesAPlainDaemonOnTheServicesExciterAlthoughTheNameIsFree) {
  auto held = take(service);
  ASSERT_TRUE(held) << held.error().what;
  const RawName name(address);
  const UniqueFd look(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(::connect(look.get(), name.get(), name.size), 0);  // the service has this name, too
  const auto refused = take(plain);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  held->reset();
  EXPECT_TRUE(take(plain));
}

TEST_F(ExciterLockTest, TheServiceRefusesWhereRootOrItsOwnUserHasTheName) {
  const auto first = take(plain);
  ASSERT_TRUE(first);
  const auto refused = take(service);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().what, HasSubstr(fmt::format("(pid {})", ::getpid())));
}

TEST_F(ExciterLockTest, NobodyElseCanOpenTheServicesLockAndEverybodyCanSeeIt) {
  const auto held = take(service);
  ASSERT_TRUE(held);
  struct stat status {};
  ASSERT_EQ(::stat((scratch.path() / ("exciter-" + address + ".lock")).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  ASSERT_EQ(::stat((scratch.path() / ("exciter-" + address)).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0666U);
}

TEST_F(ExciterLockTest, APlainDaemonLetsGoWhenTheServiceAsksAndTheServiceStartsThen) {
  if (!strangers_can_be_made()) GTEST_SKIP() << "only root can start another user's daemon";
  Stranger other([&](const auto& ready) {
    const auto held = take(plain, [](const std::string&) { ::_exit(0); });
    if (held && ready()) ::pause();
  });
  const LockPlace patient{scratch.path(), true, 20s};
  const auto held = take(patient);
  EXPECT_TRUE(held) << held.error().what;
  EXPECT_EQ(other.end(0), 0);  // it ended by itself
}

TEST_F(ExciterLockTest, AStrangerWhoHoldsTheNameCannotKeepTheServiceFromStarting) {
  if (!strangers_can_be_made()) GTEST_SKIP() << "only root can start another user's program";
  Stranger squatter([&](const auto& ready) {
    const RawName name(address);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    if (::bind(fd, name.get(), name.size) == 0 && ::listen(fd, 1) == 0 && ready()) ::pause();
  });
  const auto held = take(service);
  ASSERT_TRUE(held) << held.error().what;
  squatter.end();
  const auto refused = take(plain);  // the name is free now, but the service's lock is seen
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("the service"));
}

TEST_F(ExciterLockTest, APlainDaemonDoesNotLetGoForAStranger) {
  if (!strangers_can_be_made()) GTEST_SKIP() << "only root can start another user's program";
  std::promise<std::string> asked;
  const auto held = take(plain, [&](const std::string& who) { asked.set_value(who); });
  ASSERT_TRUE(held);
  const RawName name(address);
  Stranger caller([&](const auto& ready) {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    char byte = 0;  // until the other side has checked our credentials
    if (::connect(fd, name.get(), name.size) == 0 && ::read(fd, &byte, 1) == 0 && ready())
      ::pause();
  });
  const UniqueFd service_calls(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::connect(service_calls.get(), name.get(), name.size), 0);
  ASSERT_EQ(::send(service_calls.get(), "g", 1, MSG_NOSIGNAL), 1);  // the message of the service
  auto answer = asked.get_future();
  ASSERT_EQ(answer.wait_for(20s), std::future_status::ready);
  EXPECT_THAT(answer.get(), HasSubstr(fmt::format("(pid {})", ::getpid())));
}

TEST_F(ExciterLockTest, IsGoneWithItsProcess) {
  if (!strangers_can_be_made()) GTEST_SKIP() << "only root can start another user's daemon";
  {
    Stranger plain_one([&](const auto& ready) {
      const auto held = take(plain);
      if (held && ready()) ::pause();
    });
    EXPECT_FALSE(take(plain));
  }
  EXPECT_TRUE(take(plain));
}

}  // namespace
}  // namespace shaker::daemon
