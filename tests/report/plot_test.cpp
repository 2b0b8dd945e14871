#include "report/plot/plot.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<std::string> texts(const std::vector<Tick>& ticks) {
  std::vector<std::string> all;
  for (const auto& tick : ticks)
    all.push_back(tick.text);
  return all;
}

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++n;
  return n;
}

TEST(Ticks, AreRoundNumbersWithTheDigitsThatTellThemApart) {
  EXPECT_THAT(texts(ticks_of({0.0, 1.0, false}, 5)),
              ElementsAre("0.0", "0.2", "0.4", "0.6", "0.8", "1.0"));
  EXPECT_THAT(texts(ticks_of({-12.0, 33.0, false}, 5)), ElementsAre("-10", "0", "10", "20", "30"));
  EXPECT_THAT(texts(ticks_of({0.0, 2.5e6, false}, 3)), ElementsAre("0", "1e+06", "2e+06"));
  EXPECT_THAT(texts(ticks_of({0.5, 200.0, true}, 4)), ElementsAre("1", "10", "100"));
  EXPECT_THAT(texts(ticks_of({0.8, 6.0, true}, 6)), ElementsAre("1", "2", "5"));
}

TEST(Range, LeavesAirAndIsNeverEmpty) {
  const std::vector<double> values{1.0, std::nan(""), 3.0};
  const Range range = range_of({"u, m", {}, {}, false}, values);
  EXPECT_DOUBLE_EQ(range.from, 0.9);
  EXPECT_DOUBLE_EQ(range.to, 3.1);
  const std::vector<double> one{2.0};
  EXPECT_LT(range_of({}, one).from, range_of({}, one).to);
  EXPECT_LT(range_of({}, {}).from, range_of({}, {}).to);
  const Range decades = range_of({"", 1.0, 100.0, true}, values);
  EXPECT_DOUBLE_EQ(decades.place(10.0), 0.5);
  EXPECT_TRUE(std::isnan(decades.place(-1.0)));
}

TEST(Plot, InterruptsACurveWhereThereIsNoValue) {
  Plot plot{"Two pieces", {"t, s", 0.0, 4.0, false}, {"u, mm", 0.0, 1.0, false}, {}, {}, {}};
  plot.curves.push_back({"measured", {0, 1, 2, 3, 4}, {0, 1, std::nan(""), 1, 0}});
  const std::string svg = to_svg(plot);
  const auto at = svg.find("class=\"curve ink1\" d=\"M62.0");
  ASSERT_NE(at, std::string::npos);
  const std::string d = svg.substr(at, svg.find("/>", at) - at);
  EXPECT_EQ(count(d, "M"), 2);
  EXPECT_EQ(count(d, "L"), 2);
  EXPECT_THAT(svg, HasSubstr(">measured</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Plot, EscapesWhatItIsGiven) {
  Plot plot;
  plot.title = "a < b & \"c\"";
  EXPECT_THAT(to_svg(plot), HasSubstr("a &lt; b &amp; &quot;c&quot;"));
}

TEST(Bars, StandOnZeroOneForEachValue) {
  Bars bars;
  bars.labels = {"r01", "r02"};
  bars.series = {"before", "after"};
  bars.values = {{4.0, 2.0}, {1.0, -1.0}};
  bars.y.label = "gap";
  const std::string svg = to_svg(bars);
  EXPECT_EQ(count(svg, "<title>r0"), 4);
  EXPECT_THAT(svg, HasSubstr("r02, after: -1"));
}

// The bars of the gap: one far below the noise floor is visible and does not cover the labels.
TEST(Bars, StandOnTheBeginningOfALogarithmicAxis) {
  Bars bars;
  bars.labels = {"r01", "r02"};
  bars.series = {"before", "after"};
  bars.values = {{40.0, 20.0}, {0.9, 0.04}};
  bars.y = {"gap", 0.5, {}, true};
  const std::string svg = to_svg(bars);
  // ink2" x="..." y="..." width="..." height="...": the legend's squares have no x.
  std::vector<double> feet;
  for (const std::string bar : {"ink1\" x=\"", "ink2\" x=\""}) {
    for (std::size_t at = svg.find(bar); at != std::string::npos; at = svg.find(bar, at + 1)) {
      const auto number = [&](const std::string& key) {
        return std::stod(svg.substr(svg.find(key, at) + key.size()));
      };
      EXPECT_GT(number(" height=\""), 2.0);
      feet.push_back(number(" y=\"") + number(" height=\""));
    }
  }
  ASSERT_EQ(feet.size(), 4U);
  for (const double foot : feet)
    EXPECT_NEAR(foot, feet[0], 0.11);
}

TEST(Map, LeavesCellsWithoutAValueEmpty) {
  Map map;
  map.unit = "m/s^2";
  map.x_edges = {0, 1, 2};
  map.y_edges = {-1, 0, 1};
  map.values = {1.0, std::nan(""), -1.0, 0.0};
  const std::string svg = to_svg(map);
  EXPECT_EQ(count(svg, "</title></rect>"), 3);
  EXPECT_THAT(svg, HasSubstr("#b2182b"));
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 560 360\" width=\"560\""));
}

TEST(SvgFile, CarriesItsStyle) {
  const std::string file = svg_file(to_svg(Plot{}));
  EXPECT_THAT(file, HasSubstr("role=\"img\"><style>svg.plot{"));
}

}  // namespace
}  // namespace shaker::report
