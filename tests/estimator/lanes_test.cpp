#include "estimator/math/lanes.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

TEST(Lanes, SayWhichOfThemAreSet) {
  for (unsigned set = 0; set < 256; ++set) {
    LaneMask mask;
    for (int l = 0; l < kLanes; ++l)
      mask[l] = (set >> l & 1U) != 0 ? -1 : 0;
    EXPECT_EQ(bits_of(mask), set);
  }
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
