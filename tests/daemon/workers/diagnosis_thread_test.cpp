// The diagnosis in a separate process: it ends, lies, hangs or does not exist. Here the program
// is a shell script.
#include "daemon/workers/diagnosis_thread.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "daemon/workers/diagnosis_child.hpp"
#include "tests/daemon/workers/eventually.hpp"

namespace shaker::daemon {
namespace {

namespace fs = std::filesystem;
using testing::eventually;
using ::testing::HasSubstr;
using ::testing::Not;

class DiagnosisProcess : public ::testing::Test {
 protected:
  DiagnosisProcess() {
    std::string name = (fs::temp_directory_path() / "diagnosis.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~DiagnosisProcess() override { fs::remove_all(folder_); }

  std::vector<fs::path> script(const std::string& body) {
    std::ofstream(folder_ / "program") << "#!/bin/sh\n" << body << "\n";
    fs::permissions(folder_ / "program", fs::perms::owner_all);
    return {folder_ / "nowhere", folder_ / "program"};
  }
  static DiagnosisJob job() { return {"/data/plain.db", "/data/plain.diagnosis", {}, 0.02, true}; }
  std::string text(const std::string& file) {
    std::ifstream in(folder_ / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // Waits until the diagnosis has ended and returns its result.
  protocol::DiagnosisResultDocument result_of(DiagnosisThread& thread) {
    EXPECT_TRUE(eventually([&] { return !thread.busy(); }));
    documents_ = thread.take();
    if (documents_.empty()) return {};
    return std::get<protocol::DiagnosisResultDocument>(documents_.back());
  }
  protocol::DiagnosisResultDocument result_of(const std::vector<fs::path>& program) {
    DiagnosisThread thread(waker_, program);
    thread.begin(job());
    return result_of(thread);
  }

  fs::path folder_;
  Waker waker_;
  std::vector<protocol::Document> documents_;
};

// Whatever errno an earlier call has left.
TEST_F(DiagnosisProcess, IsReadToItsEnd) {
  auto child = DiagnosisChild::start(script("echo one; echo two"), "{}");
  ASSERT_TRUE(child) << child.error().what;
  std::vector<std::string> lines;
  int reads = 0;
  for (bool more = true; more && reads < 1000; ++reads) {
    errno = EAGAIN;
    const auto read = child->read([&](const std::string& line) { lines.push_back(line); });
    ASSERT_TRUE(read) << read.error().what;
    more = *read;
  }
  EXPECT_LT(reads, 1000);
  EXPECT_THAT(lines, ::testing::ElementsAre("one", "two"));
}

TEST_F(DiagnosisProcess, GetsTheJobAndGivesProgressAndResult) {
  const auto result = result_of(script("cat >" + (folder_ / "job").string() + R"(
echo '{"type":"progress","campaign":"c","stage":"naming","share":0.5}'
echo '{"type":"result","campaign":"d","status":"done","reason":"It is so.","folder":"/f","diagnosis":"{}"}')"));
  EXPECT_EQ(result.status, "done");
  EXPECT_EQ(result.reason, "It is so.");
  EXPECT_EQ(result.campaign, "d") << "the program's own word";
  EXPECT_EQ(result.folder, "/f");
  EXPECT_EQ(result.database, "plain.db");
  EXPECT_EQ(result.diagnosis, "{}");
  ASSERT_EQ(documents_.size(), 2U);
  EXPECT_EQ(std::get<protocol::DiagnosisProgressDocument>(documents_[0]).stage, "naming");
  EXPECT_THAT(text("job"), HasSubstr("\"database\":\"/data/plain.db\""));
  EXPECT_THAT(text("job"), HasSubstr("\"false_alarm_rate\":0.02"));
}

TEST_F(DiagnosisProcess, ThatIsKilledFailsAndTheNextOneIsDone) {
  DiagnosisThread thread(waker_, script("kill -KILL $$"));
  for (int again = 0; again < 2; ++again) {
    thread.begin(job());
    const auto result = result_of(thread);
    EXPECT_EQ(result.status, "failed");
    EXPECT_THAT(result.reason, HasSubstr("signal 9 (Killed)"));
  }
}

TEST_F(DiagnosisProcess, ThatEndsWithoutAResultFails) {
  const auto result = result_of(script("exit 3"));
  EXPECT_EQ(result.status, "failed");
  EXPECT_THAT(result.reason, HasSubstr("status 3"));
}

TEST_F(DiagnosisProcess, ThatWritesGarbageFails) {
  for (const char* garbage : {"no JSON", "[1]", "{}", R"({"type":"result","status":7})",
                              R"({"type":"progress","campaign":"c","stage":1,"share":"x"})"}) {
    const auto result = result_of(script("echo '" + std::string(garbage) + "'; exec sleep 60"));
    EXPECT_EQ(result.status, "failed") << garbage;
    EXPECT_THAT(result.reason, HasSubstr("no part of a diagnosis")) << garbage;
  }
}

TEST_F(DiagnosisProcess, ThatWritesWithoutEndFails) {
  const auto result = result_of(script("exec cat /dev/zero"));
  EXPECT_EQ(result.status, "failed");
  EXPECT_THAT(result.reason, HasSubstr("more than a diagnosis can be"));
}

TEST_F(DiagnosisProcess, ThatIsMissingFailsWithTheRemedy) {
  const auto result = result_of({folder_ / "nowhere"});
  EXPECT_EQ(result.status, "failed");
  EXPECT_THAT(result.reason, HasSubstr("cannot be started (No such file"));
  EXPECT_THAT(result.reason, HasSubstr("install the package again"));
}

TEST_F(DiagnosisProcess, ThatHangsIsKilledByACancel) {
  const auto pid_file = (folder_ / "pid").string();
  DiagnosisThread thread(waker_, script("echo $$ >" + pid_file + ".new; mv " + pid_file + ".new " +
                                        pid_file + "; trap '' TERM; exec sleep 600"));
  thread.begin(job());
  ASSERT_TRUE(eventually([&] { return fs::exists(pid_file); }));
  const pid_t process = std::stoi(text("pid"));
  thread.cancel("Cancelled by anna.");
  const auto result = result_of(thread);
  EXPECT_EQ(result.status, "cancelled");
  EXPECT_EQ(result.reason, "Cancelled by anna.");
  EXPECT_EQ(::kill(process, 0), -1);  // ended, and waited for
}

TEST_F(DiagnosisProcess, ThatSaysNothingForTooLongIsEnded) {
  const auto pid_file = (folder_ / "pid").string();
  DiagnosisThread thread(waker_, script("echo $$ >" + pid_file + R"(
for i in 1 2 3; do
  echo '{"type":"progress","campaign":"c","stage":"naming","share":0.5}'
  sleep 0.3
done
exec sleep 600)"),
                         std::chrono::seconds(3));
  thread.begin(job());
  const auto result = result_of(thread);
  EXPECT_EQ(result.status, "failed");
  EXPECT_THAT(result.reason, HasSubstr("said nothing for 3 s"));
  EXPECT_EQ(documents_.size(), 4U);  // its documents came through while it wrote
  EXPECT_EQ(::kill(std::stoi(text("pid")), 0), -1);
}

// A descriptor of the daemon (a socket, a lock) without O_CLOEXEC must not reach the process,
// and a signal that the daemon blocks must not stay blocked there.
TEST_F(DiagnosisProcess, InheritsNoDescriptorAndNoBlockedOrIgnoredSignal) {
  const int leaky = ::open("/dev/null", O_RDONLY);
  ASSERT_EQ(::fcntl(leaky, F_DUPFD, 200), 200);
  sigset_t blocked, before;
  ::sigemptyset(&blocked);
  ::sigaddset(&blocked, SIGUSR1);
  ::pthread_sigmask(SIG_BLOCK, &blocked, &before);
  const auto handler = ::signal(SIGUSR2, SIG_IGN);
  const auto at = folder_.string();
  result_of(script(
      "[ -e /proc/$$/fd/200 ] && echo leaked >" + at + "/leaked\n" + "[ -e /proc/$$/fd/" +
      std::to_string(leaky) + " ] && [ \"$(readlink /proc/$$/fd/" + std::to_string(leaky) +
      ")\" = /dev/null ] && echo leaked >" + at + "/leaked\n" +
      // Without a program: the shell blocks all signals while it starts one.
      "while read -r key mask; do [ $key = SigBlk: ] && echo $mask >" + at +
      "/signals; [ $key = SigIgn: ] && echo $mask >" + at + "/ignored; done </proc/$$/status"));
  ::signal(SIGUSR2, handler);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ::close(200);
  ::close(leaky);
  EXPECT_FALSE(fs::exists(folder_ / "leaked"));
  EXPECT_THAT(text("signals"), HasSubstr("0000000000000000"));
  const unsigned long long ignored = std::stoull(text("ignored"), nullptr, 16);
  EXPECT_EQ(ignored & (1ull << (SIGUSR2 - 1)), 0u);
}

}  // namespace
}  // namespace shaker::daemon
