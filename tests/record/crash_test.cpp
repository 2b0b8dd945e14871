// A writer is killed at random moments; everything that it had acknowledged must be in the
// file.
#include <random>
#include <signal.h>

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "record/recovery.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using testing::example_campaign;
using testing::example_sample;
using testing::Scratch;

constexpr int kSamplesPerCycle = 40;

// Writes the number of each committed cycle to `acknowledge`. Does not return.
[[noreturn]] void write_until_killed(const std::filesystem::path& directory, int acknowledge) {
  auto writer = CampaignWriter::create(directory, example_campaign());
  if (!writer) ::_exit(2);
  if (!writer->add_run({0, "r01", 2.0, 3.0, 1000})) ::_exit(3);
  for (int i = 0;; ++i) {
    std::vector<SampleRow> samples;
    for (int k = 0; k < kSamplesPerCycle; ++k) {
      samples.push_back(example_sample(i * kSamplesPerCycle + k));
    }
    const std::vector<double> wave(64, 0.5 * i);
    if (!writer->add_samples(0, samples) ||
        !writer->add_cycle({0, i, true, 2.0, 3.0, wave, wave}) ||
        !writer->add_document(static_cast<std::uint64_t>(i), std::to_string(i)) ||
        !writer->commit()) {
      ::_exit(4);
    }
    if (::write(acknowledge, &i, sizeof i) != sizeof i) ::_exit(5);
  }
}

// Returns the last acknowledged cycle, or -1. The time counts from the start, or from the first
// acknowledgement, so that it does not depend on the speed of the machine.
int run_and_kill(const std::filesystem::path& directory, int after_us, bool from_first) {
  int ends[2];
  EXPECT_EQ(::pipe(ends), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    write_until_killed(directory, ends[1]);
  }
  ::close(ends[1]);
  pollfd first{ends[0], POLLIN, 0};
  if (from_first) {
    EXPECT_EQ(::poll(&first, 1, 20'000), 1);
  }
  ::usleep(static_cast<useconds_t>(after_us));
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << status;
  int last = -1, seen = 0;
  while (::read(ends[0], &seen, sizeof seen) == sizeof seen)
    last = seen;
  ::close(ends[0]);
  return last;
}

TEST(Killed, LosesNothingThatWasAcknowledged) {
  std::mt19937 random(20260301);
  std::uniform_int_distribution<int> when_us(200, 60'000);
  int acknowledged_total = 0, empty = 0;
  for (int repetition = 0; repetition < 60; ++repetition) {
    const Scratch scratch;
    const int last = run_and_kill(scratch.path(), when_us(random), repetition % 3 != 0);
    acknowledged_total += last + 1;
    const auto found = recover(scratch.path(), "2026-03-01T12:01:00.000Z");
    // The writer was killed before its first commit: nothing may have been acknowledged.
    if (found.empty() || found[0].campaign.empty()) {
      EXPECT_EQ(last, -1) << (found.empty() ? "" : found[0].what);
      ++empty;
      continue;
    }
    ASSERT_EQ(found.size(), 1U);
    ASSERT_FALSE(found[0].damaged) << found[0].what;
    EXPECT_GE(found[0].cycles, last + 1);
    EXPECT_EQ(found[0].samples, found[0].cycles * kSamplesPerCycle);
    EXPECT_EQ(found[0].documents, found[0].cycles);

    const auto reader = CampaignReader::open(found[0].file);
    ASSERT_TRUE(reader) << reader.error().what;
    EXPECT_EQ(reader->campaign()->status, "interrupted");
    const auto cycles = reader->cycles(0);
    const auto samples = reader->samples(0);
    ASSERT_TRUE(cycles && samples);
    for (std::size_t i = 0; i < cycles->size(); ++i) {
      ASSERT_EQ((*cycles)[i].index, static_cast<std::int64_t>(i));
      ASSERT_EQ((*cycles)[i].displacement, std::vector<double>(64, 0.5 * static_cast<double>(i)));
    }
    for (std::size_t i = 0; i < samples->size(); ++i) {
      ASSERT_EQ((*samples)[i].t_ns, example_sample(static_cast<int>(i)).t_ns);
    }
  }
  EXPECT_GT(acknowledged_total, 60);  // otherwise the test shows nothing
  EXPECT_LT(empty, 40);
  RecordProperty("acknowledged_cycles", acknowledged_total);
}

// In a child process, because a limit on the file size cannot be raised again.
TEST(FullDisk, IsASentenceAndKeepsWhatWasCommitted) {
  const Scratch scratch;
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    auto writer = CampaignWriter::create(scratch.path(), example_campaign());
    if (!writer) ::_exit(2);
    const std::string line(1000, 'x');
    for (std::uint64_t i = 0; i < 100; ++i) {
      if (!writer->add_document(i, line) || !writer->commit()) ::_exit(3);
    }
    const rlimit limit{512 * 1024, 512 * 1024};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(4);
    for (std::uint64_t i = 100; i < 5000; ++i) {
      auto written = writer->add_document(i, line);
      if (written) written = writer->commit();
      if (!written) {
        const std::string& what = written.error().what;
        const bool good = what.find(writer->file().string()) != std::string::npos &&
                          what.find("space") != std::string::npos &&
                          what.find("committed before is kept") != std::string::npos;
        ::_exit(good ? 0 : 5);
      }
    }
    ::_exit(6);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  ASSERT_EQ(WEXITSTATUS(status), 0);
  const auto found = recover(scratch.path(), "2026-03-01T12:01:00.000Z");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found[0].damaged) << found[0].what;
  EXPECT_GE(found[0].documents, 100);
}

}  // namespace
}  // namespace shaker::record
