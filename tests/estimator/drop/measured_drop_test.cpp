// A measured drop beside a prediction whose differences from it are known.
#include "estimator/drop/measured_drop.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/internal/drop_curves.hpp"

namespace shaker::estimator {
namespace {

// A stroke with its top of 0.2 at 0.1 s, between samples on uneven steps, and a load with it.
MeasuredDrop parabola() {
  MeasuredDrop drop;
  for (const double t : {0.0, 0.03, 0.07, 0.094, 0.103, 0.13, 0.17}) {
    drop.t.push_back(t);
    drop.stroke.push_back(0.2 - 20.0 * (t - 0.1) * (t - 0.1));
    drop.load.push_back(40.0 - 1000.0 * (t - 0.05) * (t - 0.05));
  }
  return drop;
}

PredictedDrop prediction_of(double peak_stroke, double half_interval) {
  PredictedDrop out;
  out.figures.resize(kDropFigureCount);
  out.figures[figure_called("peak_stroke")] = {peak_stroke, peak_stroke - half_interval,
                                               peak_stroke + half_interval};
  out.figures[figure_called("peak_load")] = {44.0, 44.0, 44.0};
  out.figures[figure_called("peak_deceleration")] = {34.0, 34.0, 34.0};
  return out;
}

const ComparedFigure& said_of(const MeasuredComparison& all, const char* name) {
  for (const ComparedFigure& one : all.figures) {
    if (one.figure == figure_called(name)) return one;
  }
  throw std::out_of_range(name);
}

TEST(MeasuredDropTest, APeakBetweenUnevenSamplesIsFound) {
  const auto found = compare_drop(parabola(), prediction_of(0.21, 0.0196));
  ASSERT_TRUE(found.ok()) << found.error().what;
  const ComparedFigure& peak = said_of(*found, "peak_stroke");
  EXPECT_NEAR(peak.measured, 0.2, 1e-12);
  EXPECT_NEAR(said_of(*found, "time_of_peak_stroke").measured, 0.1, 1e-12);
  EXPECT_NEAR(peak.percent, 5.0, 1e-9);
  // Half of a 95 % interval is 1.96 standard errors.
  EXPECT_NEAR(peak.standard_errors, 1.0, 1e-4);
  const ComparedFigure& load = said_of(*found, "peak_load");
  EXPECT_NEAR(load.measured, 40.0, 1e-10);
  EXPECT_TRUE(std::isnan(load.standard_errors));
}

TEST(MeasuredDropTest, ADropThatDoesNotTurnIsRefused) {
  MeasuredDrop drop = parabola();
  for (auto* column : {&drop.t, &drop.stroke, &drop.load})
    column->resize(4);
  const auto found = compare_drop(drop, prediction_of(0.21, 0.01));
  ASSERT_FALSE(found.ok());
  EXPECT_NE(found.error().what.find("does not turn"), std::string::npos);
}

TEST(MeasuredDropTest, PointsInTheBandAreCountedToItsEnd) {
  PredictedDrop band = prediction_of(0.2, 0.01);
  band.band.t = {0.0, 0.2 * 0.75};  // before the last sample
  band.band.stroke_lower = {0.1, 0.1};
  band.band.stroke_upper = {0.3, 0.3};
  band.band.load_lower = {-100.0, -100.0};
  band.band.load_upper = {100.0, 39.0};
  const auto found = compare_drop(parabola(), band);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->in_band.size(), 2U);
  EXPECT_EQ(found->in_band[0].points, 6U);
  EXPECT_EQ(found->in_band[0].inside, 5U);  // all but the first: 0 is not between 0.1 and 0.3
  EXPECT_EQ(found->in_band[1].inside, 6U);
}

TEST(MeasuredDropTest, StraightLinesGoOnBeyondTheEnds) {
  const std::vector<double> t = {0.0, 1.0, 3.0}, y = {0.0, 2.0, 0.0};
  EXPECT_EQ(linear_at(t, y, 2.0), 1.0);
  EXPECT_EQ(linear_at(t, y, -1.0), -2.0);
  EXPECT_EQ(linear_at(t, y, 4.0), -1.0);
}

}  // namespace
}  // namespace shaker::estimator
