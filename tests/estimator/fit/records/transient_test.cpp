// Estimates from records that are not periodic, against closed forms, reference code and the
// truth.
#include "estimator/fit/records/transient.hpp"

#include <cmath>
#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;
using namespace testing;

nlohmann::json reference() {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "verbeek1991.json");
  return nlohmann::json::parse(file);
}

// (6.2), u0 = 1, v0 = 0, c = 0.25, k = 7.5 in closed form.
double decay(double t) {
  const double omega = std::sqrt(7.5 - 0.25 * 0.25 * 0.25);
  return std::exp(-0.125 * t) * (std::cos(omega * t) + 0.125 / omega * std::sin(omega * t));
}

TransientRecord record_of(std::vector<double> t, std::vector<double> y) {
  TransientRecord record;
  record.t = std::move(t);
  record.displacement = std::move(y);
  return record;
}

InitialState unknown(double value) {
  InitialState s;
  s.value = value;
  return s;
}
InitialState known(double value) {
  InitialState s = unknown(value);
  s.known = true;
  return s;
}

TransientOptions paper_like(Integrator integrator) {
  TransientOptions options;
  options.method = Method::gauss_newton;
  options.time.integrator = integrator;
  options.time.step = 0.01;
  options.keep_iterates = true;
  return options;
}

TEST(Transient, FigureSixAndSevenIterateByIterate) {
  const auto data = reference();
  const Model model(linear_oscillator());
  for (const Integrator integrator : {Integrator::adams, Integrator::runge_kutta4}) {
    for (const char* figure : {"fig6", "fig7"}) {
      const auto& entry = data.at(figure);
      auto record = record_of(entry.at("settings").at("t"), entry.at("data_y"));
      record.initial = {unknown(1.05), unknown(0.0)};
      TransientEstimator estimator(model, {record}, paper_like(integrator));
      const auto& fit = estimator.fit({0.2625, 7.875});
      EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
      const auto& expected = entry.at("iterates");
      ASSERT_GE(fit.iterates.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) {
          EXPECT_NEAR(fit.iterates[i][k], expected[i][k].get<double>(), 1e-6)
              << figure << " iterate " << i + 1;
          EXPECT_NEAR(fit.iterates[i][k], entry.at("printed")[i][k].get<double>(), 5.1e-5);
        }
      }
    }
  }
}

// The covariance (3.27) at the exact parameters, from the reference code, for noise U(-w, w).
TEST(Transient, CovarianceIsThatOfTheReference) {
  const auto data = reference();
  const Model model(linear_oscillator());
  for (const char* figure : {"fig6", "fig7"}) {
    const std::vector<double> t = data.at(figure).at("settings").at("t");
    std::vector<double> y;
    for (const double at : t)
      y.push_back(decay(at));
    auto record = record_of(t, y);
    record.initial = {unknown(1.05), unknown(0.0)};
    TransientEstimator estimator(model, {record});
    const auto& fit = estimator.fit({0.2625, 7.875});
    ASSERT_EQ(fit.status, FitStatus::converged);
    EXPECT_NEAR(fit.theta[0], 0.25, 1e-7);
    EXPECT_NEAR(fit.theta[1], 7.5, 1e-7);
    EXPECT_NEAR(fit.initial[0][1], 0.0, 1e-7);
    const auto& mc = data.at("monte_carlo").at(figure);
    const double w = mc.at("w"), variance = w * w / 3.0 / (fit.noise * fit.noise);
    const int order[] = {2, 3, 0, 1};  // the reference has the initial state first
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const auto row = static_cast<std::size_t>(order[i]),
                   column = static_cast<std::size_t>(order[k]);
        const double expected = mc.at("cov_linearised")[row][column];
        EXPECT_NEAR(fit.covariance[i * 4 + k] * variance, expected,
                    1e-4 * std::fabs(expected) + 1e-7);
      }
    }
    EXPECT_EQ(fit.degrees_of_freedom, 1);
    EXPECT_NEAR(fit.quantile, 12.706, 1e-3);  // Student's t with one degree of freedom
  }
}

TransientOptions rk4_of_the_paper() {
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  options.time.cut = CutAtReversals::never;
  return options;
}

TransientRecord paper_record(const nlohmann::json& entry, const char* key) {
  std::vector<double> t;
  for (int i = 0; i <= 50; ++i)
    t.push_back(0.01 * i);
  auto record = record_of(t, entry.at(key));
  record.initial = {unknown(0.42), unknown(0.0)};
  return record;
}

// Figure 9 with the correct derivative: five iterations, not eleven.
TEST(Transient, FigureNineWithTheRightDerivativeNeedsFiveIterations) {
  const auto data = reference();
  const Model model(oleo(32.1859));
  auto options = rk4_of_the_paper();
  options.method = Method::gauss_newton;
  options.keep_iterates = true;
  TransientEstimator estimator(model, {paper_record(data.at("fig9"), "data_y")}, options);
  const auto& fit = estimator.fit({5.334, 5.25, 1.701, 1.05});
  EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  const auto& expected = data.at("fig9").at("iterates_c2_correct");
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(fit.iterates[i][k], expected[i][k].get<double>(), 1e-7) << i;
  }
  const std::vector<double> exact = {0.4, 0.0, 5.08, 5.0, 1.62, 1.0};
  double fourth = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    fourth = std::max(fourth, std::fabs(fit.iterates[3][k] - exact[k]));
    EXPECT_NEAR(fit.iterates[4][k], exact[k], 5e-5);
  }
  EXPECT_GT(fourth, 5e-5);
}

// The record of figure 10, and the optimum that the error in the paper prevented.
TEST(Transient, FigureTensRecordHasTheOptimumOfTheReference) {
  const auto data = reference();
  const Model model(oleo(32.1859));
  TransientEstimator estimator(model, {paper_record(data.at("fig10"), "data_y")},
                               rk4_of_the_paper());
  const auto& fit = estimator.fit({5.334, 5.25, 1.701, 1.05});
  EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  const auto& expected = data.at("fig10").at("least_squares_estimate_of_same_record");
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(fit.initial[0][k], expected[k].get<double>(), 1e-6);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.theta[k], expected[k + 2].get<double>(), 2e-5);
}

TEST(Transient, SaysThatTwoDampersCannotBeToldApart) {  // (6.1)
  const Model model(
      model_of({effect("viscous_damping"), effect("viscous_damping"), effect("linear_stiffness")}));
  std::vector<double> t, y;
  for (int i = 0; i <= 80; ++i) {
    t.push_back(0.05 * i);
    y.push_back(decay(t.back()));
  }
  TransientEstimator estimator(model, {record_of(t, y)});
  const auto& fit = estimator.fit({0.1, 0.3, 7.0});
  EXPECT_EQ(fit.status, FitStatus::undetermined) << fit.trouble;
  EXPECT_FALSE(fit.determined[0]);
  EXPECT_FALSE(fit.determined[1]);
  EXPECT_TRUE(fit.determined[2]);
  EXPECT_NEAR(fit.theta[2], 7.5, 1e-6);
  EXPECT_NEAR(fit.theta[0] + fit.theta[1], 0.25, 1e-6);
  const Estimate e = estimator.describe();
  EXPECT_FALSE(e.usable);
  EXPECT_THAT(e.warnings, ::testing::Contains(HasSubstr("do not determine")));
}

TEST(Transient, KnownInitialConditionsAreNotEstimated) {
  const Model model(linear_oscillator());
  std::vector<double> t, y;
  for (int i = 1; i <= 40; ++i) {
    t.push_back(0.1 * i);
    y.push_back(decay(t.back()));
  }
  auto record = record_of(t, y);
  record.start = 0.0;
  record.initial = {known(1.0), known(0.0)};
  TransientEstimator estimator(model, {record});
  const auto& fit = estimator.fit({0.3, 6.5});
  EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  EXPECT_NEAR(fit.theta[0], 0.25, 1e-8);
  EXPECT_NEAR(fit.theta[1], 7.5, 1e-8);
  EXPECT_EQ(fit.covariance.size(), 4U);
  EXPECT_EQ(fit.initial_error[0], (std::vector<double>{0.0, 0.0}));
  EXPECT_EQ(estimator.predicted(0).size(), 40U);
  EXPECT_EQ(estimator.sensitivities(0).size(), 80U);
}

// Random excitation with many harmonics; the truth is from CVODES at 1e-12, with white noise.
struct Long {
  TransientRecord record;
  std::vector<double> clean;
};
Long long_record(const Model& model, const std::vector<double>& theta, std::size_t samples,
                 double rate, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 6.283185307179586);
  std::vector<double> f, p;
  for (int i = 0; i < 20; ++i) {
    f.push_back(0.5 + 0.45 * i);
    p.push_back(phase(random));
  }
  Long out;
  std::vector<double> t, x;
  for (std::size_t i = 0; i < samples; ++i) {
    t.push_back(static_cast<double>(i) / rate);
    double sum = 0.0;
    for (std::size_t k = 0; k < f.size(); ++k)
      sum += 1.1 * std::cos(6.283185307179586 * f[k] * t.back() + p[k]);
    x.push_back(sum);
  }
  out.record.excitation = Excitation::sampled(t, x);
  const StateEquations equations(model);
  TimeOptions options;
  options.relative_tolerance = 1e-11;
  Arc arc;
  arc.times = t;
  arc.excitation = &out.record.excitation;
  arc.start.assign(static_cast<std::size_t>(equations.states()), 0.0);
  arc.start[0] = 0.15;
  EXPECT_TRUE(TimeIntegration::make(equations, options, {})->run({&arc, 1}, theta, false).ok);
  const auto m = static_cast<std::size_t>(equations.states());
  for (std::size_t i = 0; i < samples; ++i) {
    out.clean.push_back(arc.states[i * m + static_cast<std::size_t>(model.observed())]);
    out.record.displacement.push_back(out.clean.back() + noise * normal(random));
  }
  out.record.t = std::move(t);
  return out;
}

std::vector<double> off(const std::vector<double>& theta, double by) {
  auto out = theta;
  for (double& v : out)
    v *= by;
  return out;
}

TEST(Transient, SegmentsFindWhatOneTrajectoryFinds) {
  const Model model(oleo());
  const auto data = long_record(model, kOleoSi, 2000, 200.0, 5e-4, 7);
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  options.segment = 100;
  TransientEstimator many(model, {data.record}, options);
  const auto& a = many.fit(off(kOleoSi, 1.05));
  EXPECT_EQ(a.status, FitStatus::converged) << a.trouble;
  EXPECT_LT(a.largest_gap, 1e-9);
  options.segment = 5000;
  TransientEstimator one(model, {data.record}, options);
  const auto& b = one.fit(off(kOleoSi, 1.05));
  EXPECT_EQ(b.status, FitStatus::converged) << b.trouble;
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(a.theta[k], b.theta[k], 1e-6 * b.theta[k]);
    EXPECT_NEAR(a.standard_error[k], b.standard_error[k], 1e-4 * b.standard_error[k]);
    EXPECT_LT(std::fabs(a.theta[k] - kOleoSi[k]), 4.0 * a.standard_error[k]);
  }
  EXPECT_NEAR(a.sum_of_squares, b.sum_of_squares, 1e-8 * b.sum_of_squares);
  EXPECT_NEAR(a.noise, 5e-4, 5e-5);
  const auto sa = many.sensitivities(0), sb = one.sensitivities(0);
  ASSERT_EQ(sa.size(), 2000U * 6);
  for (std::size_t i = 0; i < sa.size(); i += 31)
    EXPECT_NEAR(sa[i], sb[i], 1e-6 * (1.0 + std::fabs(sb[i])));
  EXPECT_EQ(many.residuals(0).size(), 2000U);
}

TEST(Transient, SegmentsConvergeFromWhereOneTrajectoryRunsIntoTheWall) {
  const Model model(oleo());
  const auto data = long_record(model, kOleoSi, 3000, 200.0, 2e-4, 11);
  const std::vector<double> start = {2.0, 4.0, 5.35, 0.5};
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  options.segment = 50;

  const StateEquations equations(model);
  Arc whole;
  whole.times = data.record.t;
  whole.excitation = &data.record.excitation;
  whole.start = {0.15, 0.0};
  const auto alone = TimeIntegration::make(equations, options.time, {});
  EXPECT_TRUE(alone->run({&whole, 1}, start, false).inadmissible);

  TransientEstimator segments(model, {data.record}, options);
  const auto& fit = segments.fit(start);
  EXPECT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(std::fabs(fit.theta[k] - kOleoSi[k]), 4.0 * fit.standard_error[k]) << k;
}

TEST(Transient, CvodesAndRungeKuttaAgreeOnTwoCoordinates) {
  const Model model(oleo_on_tyre(0.1));
  const std::vector<double> truth = {5.08 / 0.3048, 5.0 * 0.3048, 1.62 / 0.3048, 1.0, 400.0, 6.0};
  const auto data = long_record(model, truth, 600, 200.0, 1e-5, 3);
  TransientOptions options;
  options.segment = 100;
  TransientEstimator cvodes(model, {data.record}, options);
  const auto& a = cvodes.fit(off(truth, 1.03));
  EXPECT_EQ(a.status, FitStatus::converged) << a.trouble;
  options.time.integrator = Integrator::runge_kutta4;
  options.time.step = 1e-3;
  TransientEstimator rk4(model, {data.record}, options);
  const auto& b = rk4.fit(off(truth, 1.03));
  EXPECT_EQ(b.status, FitStatus::converged) << b.trouble;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    EXPECT_LT(std::fabs(a.theta[k] - truth[k]), 4.0 * a.standard_error[k]) << k;
    EXPECT_LT(std::fabs(a.theta[k] - b.theta[k]), 0.05 * a.standard_error[k]) << k;
  }
}

TEST(Transient, BoundsHold) {
  auto spec = linear_oscillator();
  const std::string name = Model(linear_oscillator()).parameters()[1].name;
  spec.effects[1].parameters[name].upper = 7.0;
  spec.effects[1].parameters[name].start = 6.0;
  const Model model(spec);
  std::vector<double> t, y;
  for (int i = 0; i <= 60; ++i) {
    t.push_back(0.05 * i);
    y.push_back(decay(t.back()));
  }
  TransientEstimator estimator(model, {record_of(t, y)});
  const auto& fit = estimator.fit({0.3, 6.0});
  EXPECT_EQ(fit.theta[1], 7.0);
  EXPECT_TRUE(fit.at_bound[1]);
  EXPECT_FALSE(estimator.describe().usable);
}

TEST(Transient, RefusesARecordBeyondTheWallInWords) {
  const Model model(oleo());
  std::vector<double> t, y;
  for (int i = 0; i < 20; ++i) {
    t.push_back(0.01 * i);
    y.push_back(0.25);
  }
  TransientEstimator estimator(model, {record_of(t, y)});
  const auto& fit = estimator.fit(kOleoSi);
  EXPECT_EQ(fit.status, FitStatus::no_solution);
  EXPECT_THAT(fit.trouble, HasSubstr("record 1"));
  EXPECT_FALSE(estimator.describe().usable);
}

TEST(Transient, RefusesBadRecordsWithThePlace) {
  const Model model(linear_oscillator());
  const auto why = [&](const TransientRecord& record) -> std::string {
    try {
      TransientEstimator estimator(model, {record});
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_THAT(why(record_of({0.0, 0.1, 0.1}, {1, 2, 3})), HasSubstr("sample 3"));
  EXPECT_THAT(why(record_of({0.0, 0.1, 0.2}, {1, std::nan(""), 3})), HasSubstr("sample 2"));
  EXPECT_THAT(why(record_of({0.0, 0.1}, {1})), HasSubstr("2 times for 1"));
  EXPECT_THAT(why(record_of({0.0}, {1})), HasSubstr("at least 2"));
  auto record = record_of({0.0, 0.1, 0.2}, {1, 2, 3});
  record.initial = {known(1.0)};
  EXPECT_THAT(why(record), HasSubstr("2 states"));
  record.initial.clear();
  record.start = 0.05;
  EXPECT_THAT(why(record), HasSubstr("after the first sample"));
}

}  // namespace
}  // namespace shaker::estimator
