// The short form of the blind suite's records; `blind_suite --records` runs all of it.
#include "tests/blind/records.hpp"

#include <gtest/gtest.h>

namespace shaker::blind {
namespace {

// The first `count` of them, shapes and plants in turn.
void expect_nothing_named(RecordNoise noise, int count) {
  for (const RecordCase& wanted : record_nulls(30)) {
    if (wanted.noise != noise) continue;
    if (count-- == 0) return;
    const Answer a = answer(wanted);
    EXPECT_EQ(a.verdict, "adequate") << wanted.label() << a.trouble;
  }
}

TEST(BlindRecords, NameNothingWhereNothingIsMissingUnderWhiteNoise) {
  expect_nothing_named(RecordNoise::white, 6);
}

TEST(BlindRecords, NameNothingWhereNothingIsMissingUnderColouredNoise) {
  expect_nothing_named(RecordNoise::coloured, 4);
  expect_nothing_named(RecordNoise::coloured_excitation, 2);
}

TEST(BlindRecords, NameNothingWhereNothingIsMissingUnderNoiseOfTheMeasuredExcitation) {
  expect_nothing_named(RecordNoise::excitation, 3);
}

}  // namespace
}  // namespace shaker::blind
