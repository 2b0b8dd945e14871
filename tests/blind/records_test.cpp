// The short form of the blind suite's records; `blind_suite --records` runs all of it.
#include "tests/blind/records.hpp"

#include <cctype>
#include <ostream>

#include <gtest/gtest.h>

#include "tests/sanitized.hpp"

namespace shaker::blind {

// The name that GoogleTest prints for a case.
inline void PrintTo(const RecordCase& wanted, std::ostream* out) {
  *out << wanted.label();
}

namespace {

// The first few cases of each noise; shapes and plants alternate. Coloured noise multiplies the
// run time of long records, so those are shorter here. A sanitizer sees one case of each noise.
std::vector<RecordCase> some_nulls() {
  std::vector<RecordCase> some;
  const auto take = [&](RecordNoise noise, int count, double seconds) {
    for (RecordCase wanted : record_nulls(30)) {
      if (wanted.noise != noise || count-- <= 0) continue;
      wanted.seconds = kSanitized ? seconds / 2.0 : seconds;
      if (kSanitized) count = 0;
      some.push_back(wanted);
    }
  };
  take(RecordNoise::white, 6, 12.0);
  take(RecordNoise::coloured, 4, 4.0);
  take(RecordNoise::excitation, 3, 12.0);
  take(RecordNoise::coloured_excitation, 2, 6.0);
  return some;
}

std::string test_name(const ::testing::TestParamInfo<RecordCase>& of) {
  std::string name;
  for (const char c : of.param.label()) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  return name;
}

class BlindRecord : public ::testing::TestWithParam<RecordCase> {};

TEST_P(BlindRecord, IsAdequateWhereNothingIsMissing) {
  const Answer a = answer(GetParam());
  EXPECT_EQ(a.verdict, "adequate") << a.trouble;
}

INSTANTIATE_TEST_SUITE_P(Some, BlindRecord, ::testing::ValuesIn(some_nulls()), test_name);

}  // namespace
}  // namespace shaker::blind
