#include "cli/terminal.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

TEST(Terminal, ShowsTheEntriesThatFitAndThatThereAreMore) {
  const std::string bar =
      "[##..]  50 %  theta1 16.67 ± 0.02, theta2 1.52 ± 0.01, f_c 0.150 ± 0.002";
  const std::string two = "[##..]  50 %  theta1 16.67 ± 0.02, theta2 1.52 ± 0.01, ...";
  const std::string one = "[##..]  50 %  theta1 16.67 ± 0.02, ...";
  EXPECT_EQ(fitted(bar, 72), bar);
  EXPECT_EQ(fitted(bar, 71), two);
  EXPECT_EQ(fitted(bar, 58), two);
  EXPECT_EQ(fitted(bar, 57), one);
  EXPECT_EQ(fitted(bar, 38), one);
  EXPECT_EQ(fitted(bar, 20), "[##..]  50 %  theta1");  // no entry fits
}

TEST(Terminal, WrapsAtSpacesAndCutsOnlyWordsThatAreTooLong) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(wrapped("the campaign ends", 17), Lines{"the campaign ends"});
  EXPECT_EQ(wrapped("the campaign ends", 16), (Lines{"the campaign", "  ends"}));
  EXPECT_EQ(wrapped("the campaign ends", 12), (Lines{"the campaign", "  ends"}));
  EXPECT_EQ(wrapped("at /var/lib/shakerd", 12), (Lines{"at", "  /var/lib/s", "  hakerd"}));
  EXPECT_EQ(wrapped("±±±±±±±±±±±±", 12), Lines{"±±±±±±±±±±±±"});
  EXPECT_EQ(wrapped("", 12), Lines{""});
}

}  // namespace
}  // namespace shaker::cli
