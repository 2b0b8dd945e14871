// The n-th allocation fails while a campaign is written: no crash, and acknowledged data hold.
#include "tests/record/torture/memory.hpp"

#include <cstdio>
#include <new>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/record/scratch.hpp"
#include "tests/record/torture/effort.hpp"
#include "tests/record/torture/recording.hpp"

namespace shaker::record::torture {
namespace {

using testing::Scratch;

struct Outcome {
  int acknowledged = 0;
  bool error = false, exception = false;
  std::filesystem::path file;
};

void write(const std::filesystem::path& directory, int commits, Outcome& outcome) {
  auto writer = CampaignWriter::create(directory, testing::example_campaign());
  if (!writer) {
    outcome.error = true;
    return;
  }
  outcome.file = writer->file();
  for (int i = 0; i < commits; ++i) {
    if (!add_commit(*writer, i)) {
      outcome.error = true;
      return;
    }
    outcome.acknowledged = i + 1;
  }
  outcome.error = !writer->finish("success", kNow);
}

TEST(Memory, EveryAllocationOnceAndForGood) {
  Memory::install();
  const int commits = effort().count > 0 ? 12 : 2;
  const int step = effort().count > 0 ? 1 : 5;
  for (const bool for_good : {false, true}) {
    std::int64_t n = 1;
    int errors = 0, exceptions = 0;
    for (bool reached = true; reached; n += step) {
      const Scratch scratch(Scratch::in_memory);
      Outcome outcome;
      Memory::fail_at(n, for_good);
      try {
        write(scratch.path(), commits, outcome);
      } catch (const std::bad_alloc&) {
        outcome.exception = true;
      }
      reached = Memory::reached();
      Memory::fail_at(0, false);
      errors += outcome.error ? 1 : 0;
      exceptions += outcome.exception ? 1 : 0;
      if (outcome.file.empty()) continue;
      const Verdict verdict = judge(outcome.file, remains_of(outcome.file), outcome.acknowledged);
      EXPECT_EQ(verdict.violation, "") << "allocation " << n << ", for good " << for_good;
      EXPECT_GE(verdict.read, outcome.acknowledged) << "allocation " << n;
      EXPECT_FALSE(verdict.damaged) << "allocation " << n;
      if (!reached) {
        EXPECT_FALSE(outcome.error || outcome.exception);
      }
    }
    std::printf("%ld allocations, every %d. failed %s: %d Errors, %d std::bad_alloc\n",
                static_cast<long>(n), step, for_good ? "for good" : "once", errors, exceptions);
    EXPECT_GT(errors + exceptions, 20);
  }
}

}  // namespace
}  // namespace shaker::record::torture
