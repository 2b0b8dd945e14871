#include "estimator/math/lanes.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

static_assert(sizeof(Lanes) == kLanes * sizeof(double) && alignof(Lanes) == sizeof(Lanes));

TEST(Lanes, SayWhichOfThemAreSet) {
  for (unsigned set = 0; set < 256; ++set) {
    LaneMask mask;
    for (int l = 0; l < kLanes; ++l)
      mask[l] = (set >> l & 1U) != 0 ? -1 : 0;
    EXPECT_EQ(bits_of(mask), set);
    EXPECT_EQ(bits_of(mask_of(set)), set);
    EXPECT_EQ(bits_of(~mask), set ^ 255U);
  }
  EXPECT_EQ(bits_of(lanes_between(1, 4)), 0b11110U);
  EXPECT_EQ(bits_of(lanes_between(-3, 0)), 1U);
  EXPECT_EQ(bits_of(lanes_between(7, 30)), 128U);
}

TEST(Lanes, PassOverWhatIsNoNumber) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  Lanes x = 2.0;
  x[0] = none;
  x[5] = -3.0;
  EXPECT_EQ(bits_of(x < 0.0), 32U);
  EXPECT_EQ(bits_of(x >= 2.0), 255U - 32U - 1U);
  EXPECT_EQ(bits_of(x == x), 254U);
  Lanes largest = 2.5;
  keep_largest(largest, x);
  EXPECT_EQ(largest[0], 2.5);
  EXPECT_EQ(largest[5], 3.0);
  x[6] = std::numeric_limits<double>::infinity();
  keep_finite(x);
  EXPECT_EQ(x[0], 0.0);
  EXPECT_EQ(x[6], 0.0);
  EXPECT_EQ(x[5], -3.0);
}

TEST(Lanes, AreTurnedFromRowsIntoColumns) {
  Lanes rows[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    for (int k = 0; k < kLanes; ++k)
      rows[l][k] = 10.0 * l + k;
  }
  transpose(rows);
  for (int l = 0; l < kLanes; ++l) {
    for (int k = 0; k < kLanes; ++k)
      EXPECT_EQ(rows[l][k], 10.0 * k + l) << l << " " << k;
  }
}

}  // namespace
}  // namespace shaker::estimator
