#include "estimator/diagnosis/fit/internal/imposed_motion.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

// Presliding friction, f_c z / z0 with z' = v - |v| z / z0, in small steps with its closed
// form: while v is constant, z tends to +-z0 as exp(-distance / z0).
std::vector<double> friction_force(const std::vector<double>& u, double f_c, double z0) {
  std::vector<double> force(u.size());
  double z = 0.0;
  for (int lap = 0; lap < 3; ++lap) {
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double step = u[i] - u[(i + u.size() - 1) % u.size()];
      const double target = step >= 0.0 ? z0 : -z0;
      z = target + (z - target) * std::exp(-std::fabs(step) / z0);
      force[i] = f_c * z / z0;
    }
  }
  return force;
}

TEST(ImposedMotion, CarriesTheMemoryAlongTheCycle) {
  auto spec = estimator::testing::model_of({estimator::testing::effect("presliding_friction")});
  const Model model(spec);
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(3);
  motion[1] = 0.01;
  ImposedMotion imposed(model, 1.0, motion, 512);
  const std::vector<double> theta = {0.8, 1e-3};
  ASSERT_TRUE(imposed.at(theta));
  std::vector<double> u;
  for (int i = 0; i < 51200; ++i)
    u.push_back(0.01 * std::cos(kTwoPi * i / 51200.0));
  const auto expected = friction_force(u, 0.8, 1e-3);
  double worst = 0.0;
  for (int i = 0; i < 512; ++i)
    worst = std::max(worst,
                     std::fabs(imposed.force()[i] - expected[static_cast<std::size_t>(100 * i)]));
  EXPECT_LT(worst, 0.02);

  // Compares the slopes with finite differences.
  const Eigen::VectorXd force = imposed.force();
  const Eigen::MatrixXd slope = imposed.slope();
  for (int k = 0; k < 2; ++k) {
    std::vector<double> moved = theta;
    const double h = 1e-5 * theta[static_cast<std::size_t>(k)];
    moved[static_cast<std::size_t>(k)] += h;
    ASSERT_TRUE(imposed.at(moved));
    const Eigen::VectorXd difference = (imposed.force() - force) / h;
    EXPECT_LT((difference - slope.col(k)).norm(), 1e-3 * slope.col(k).norm()) << k;
  }
}

// The Bouc-Wen loop in small steps of its slope over the stroke: 1 - (1 + gamma) |s| on the way
// out and 1 + (1 - gamma) |s| on the way back.
TEST(ImposedMotion, FollowsLoopsThatSoftenAndLoopsThatHarden) {
  auto spec = estimator::testing::model_of({estimator::testing::effect("bouc_wen_hysteresis")});
  spec.effects[0].constants = {{"e", 1e-5}, {"r", 1e-4}};
  const Model model(spec);
  constexpr int kPoints = 512, kSteps = 400;
  const double amplitude = 2e-3, z0 = 1e-3;
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(3);
  motion[1] = amplitude;
  for (const double gamma : {1.0, 0.0, -1.0, -1.4}) {
    ImposedMotion imposed(model, 1.0, motion, kPoints);
    ASSERT_TRUE(imposed.at(std::vector<double>{10.0, z0, gamma, 1.0})) << gamma;
    double s = 0.0, worst = 0.0, largest = 0.0;
    for (int i = 1; i <= 3 * kPoints * kSteps; ++i) {
      const auto stroke = [&](int at) { return std::cos(kTwoPi * at / (kPoints * kSteps)); };
      const double step = amplitude * (stroke(i) - stroke(i - 1)) / z0;
      s += step - std::fabs(step) * s - gamma * step * std::fabs(s);
      largest = std::max(largest, std::fabs(s));
      if (i <= 2 * kPoints * kSteps || i % kSteps != 0) continue;
      worst = std::max(worst, std::fabs(imposed.force()[i / kSteps % kPoints] - 10.0 * s));
    }
    EXPECT_LT(worst, 0.01 * 10.0 * largest) << gamma;
    const double length = 2.0 * amplitude / z0;
    if (gamma < -1.0) {
      EXPECT_LT(largest, std::expm1(-(1.0 + gamma) * length) / -(1.0 + gamma));
    }
  }
}

// A viscous damper behind a play, c d' = F(u - d), in small explicit steps. The stops are met over a
// depth of 2e-5 m, as the catalogue says.
std::vector<double> force_behind_play(const Motion& motion, double c, double play, double k) {
  constexpr int kSteps = 400;
  std::vector<double> force;
  const auto stop = [](double depth) {
    return std::max(depth, 0.0) + 2e-5 * std::log1p(std::exp(-std::fabs(depth) / 2e-5));
  };
  double d = motion.u[0];
  for (Eigen::Index i = 0; i + 1 < motion.u.size(); ++i) {
    double f = 0.0;
    for (int j = 0; j < kSteps; ++j) {
      const double y = motion.u[i] + (motion.u[i + 1] - motion.u[i]) * j / kSteps - d;
      f = k * (stop(y - 0.5 * play) - stop(-y - 0.5 * play));
      if (j == 0) force.push_back(f);
      d += motion.dt / kSteps * f / c;
    }
  }
  return force;
}

// The course of a load path from that of the model without a further effect, on twice the steps:
// the same force as from nothing, for less work.
TEST(MotionIntegrator, BeginsFromTheCourseOfASmallerModel) {
  using estimator::testing::effect;
  const Model smaller(
      estimator::testing::model_of({effect("viscous_damping"), effect("free_play")}));
  const Model larger(estimator::testing::model_of(
      {effect("viscous_damping"), effect("free_play"), effect("linear_stiffness")}));
  const auto motion = [](int n) {
    const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(n, 0.0, 1.0 - 1.0 / n) * kTwoPi;
    return Motion{
        1.0 / n, 0.01 * t.cos(), -0.01 * kTwoPi * t.sin(), -0.01 * kTwoPi * kTwoPi * t.cos(), {}};
  };
  constexpr int kPoints = 1024;
  MotionIntegrator finer(smaller, motion(2 * kPoints), false);
  ASSERT_TRUE(finer.at(std::vector<double>{10.0, 2e-3, 2e4}));
  MotionIntegrator begun(larger, motion(kPoints), false), fresh(larger, motion(kPoints), false);
  begun.begin_from(finer);
  const std::vector<double> theta = {10.0, 2e-3, 2e4, 0.0};
  ASSERT_TRUE(fresh.at(theta));
  ASSERT_TRUE(begun.at(theta));
  const double largest = fresh.force().cwiseAbs().maxCoeff();
  EXPECT_LT((begun.force() - fresh.force()).cwiseAbs().maxCoeff(), 1e-7 * largest);
  EXPECT_LT((begun.slope() - fresh.slope()).norm(), 1e-6 * fresh.slope().norm());
  const auto expected = force_behind_play(motion(kPoints), 10.0, 2e-3, 2e4);
  double worst = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    worst = std::max(worst, std::fabs(fresh.force()[static_cast<Eigen::Index>(i)] - expected[i]));
  EXPECT_LT(worst, 0.05 * largest);

  // Work for two evaluations of all steps, two between points: too little from nothing, where each
  // step takes two.
  const double work = 0.03 * 2.5 * 2 * kPoints * 2 * (2 + 4);
  MotionIntegrator again(larger, motion(kPoints), false);
  again.begin_from(begun);
  MotionIntegrator nothing(larger, motion(kPoints), false);
  for (MotionIntegrator* integrator : {&again, &nothing}) {
    const auto budget = std::make_shared<EvaluationBudget>();
    const Task task(budget, work);
    integrator->spend(budget);
    EXPECT_EQ(integrator->at(theta), integrator == &again);
  }
}

// Motion and models of a load path with play and hysteresis.
Motion cosine(int n, int cycles, bool periodic) {
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(n * cycles, 0.0, cycles - 1.0 / n) * kTwoPi;
  Motion motion{
      1.0 / n, 0.01 * t.cos(), -0.01 * kTwoPi * t.sin(), -0.01 * kTwoPi * kTwoPi * t.cos(), {}};
  motion.periodic = periodic;
  return motion;
}

config::ModelSpec hysteresis_behind_play() {
  using estimator::testing::effect;
  return estimator::testing::model_of(
      {effect("viscous_damping"), effect("bouc_wen_hysteresis"), effect("free_play")});
}

const std::vector<double> kHysteresisBehindPlay = {10.0, 2.0, 1e-3, 0.5, 1.3, 2e-3, 2e4};

// The work of at() from nothing, or from the course of another integrator.
double work_of(MotionIntegrator& integrator) {
  const auto budget = std::make_shared<EvaluationBudget>(1.0);
  integrator.spend(budget);
  EXPECT_TRUE(integrator.at(kHysteresisBehindPlay));
  double low = 0.0, high = 1e9;  // shares of the budget's limit
  while (high - low > 1.0) {
    const double middle = 0.5 * (low + high);
    (budget->leaves_less_than(1.0 - middle) ? low : high) = middle;
  }
  return high;
}

// The second cycle is integrated only until it repeats the first: the force and the slopes of the
// third cycle of a long record, for the work of less than two cycles.
TEST(MotionIntegrator, EndsACycleWhereItRepeatsTheOneBefore) {
  const Model model(hysteresis_behind_play());
  constexpr int kPoints = 1024;
  MotionIntegrator cycle(model, cosine(kPoints, 1, true), false);
  MotionIntegrator two(model, cosine(kPoints, 2, false), false);
  MotionIntegrator record(model, cosine(kPoints, 3, false), false);
  ASSERT_TRUE(record.at(kHysteresisBehindPlay));
  EXPECT_LT(work_of(cycle), 0.75 * work_of(two));
  const Eigen::VectorXd force = record.force().tail(kPoints);
  EXPECT_LT((cycle.force() - force).norm(), 1e-8 * force.norm());
  for (int k = 0; k < model.parameter_count(); ++k) {
    const Eigen::VectorXd slope = record.slope().col(k).tail(kPoints);
    EXPECT_LT((cycle.slope().col(k) - slope).norm(), 1e-6 * slope.norm()) << k;
  }
}

// A grid of twice the points begins with the course of the coarser one, for half the work.
TEST(MotionIntegrator, BeginsFromTheCourseOnACoarserGrid) {
  const Model model(hysteresis_behind_play());
  constexpr int kPoints = 1024;
  MotionIntegrator coarse(model, cosine(kPoints, 1, true), false);
  ASSERT_TRUE(coarse.at(kHysteresisBehindPlay));
  MotionIntegrator fresh(model, cosine(2 * kPoints, 1, true), false);
  MotionIntegrator begun(model, cosine(2 * kPoints, 1, true), false);
  begun.begin_from(coarse);
  EXPECT_LT(work_of(begun), 0.8 * work_of(fresh));
  EXPECT_LT((begun.force() - fresh.force()).norm(), 2e-8 * fresh.force().norm());
  EXPECT_LT((begun.slope() - fresh.slope()).norm(), 1e-6 * fresh.slope().norm());
}

// The course for nearby parameters follows from the derivatives of the last one.
TEST(MotionIntegrator, PredictsTheCourseForNearbyParameters) {
  const Model model(hysteresis_behind_play());
  MotionIntegrator known(model, cosine(1024, 1, true), false);
  MotionIntegrator unknown(model, cosine(1024, 1, true), false);
  std::vector<double> nearby = kHysteresisBehindPlay;
  for (double& value : nearby)
    value *= 1.0001;
  ASSERT_TRUE(known.at(nearby));
  ASSERT_TRUE(unknown.at(nearby, false));
  EXPECT_LT(work_of(known), 0.9 * work_of(unknown));
  EXPECT_LT((known.force() - unknown.force()).norm(), 1e-8 * unknown.force().norm());
}

// Two models that hold one coordinate each tell where to begin with both. The solution is the same.
TEST(MotionIntegrator, BeginsFromTheCoursesOfTwoModels) {
  using estimator::testing::effect;
  const Model model(hysteresis_behind_play());
  const Model play(estimator::testing::model_of({effect("viscous_damping"), effect("free_play")}));
  MotionIntegrator behind_play(play, cosine(1024, 1, true), false);
  ASSERT_TRUE(behind_play.at(std::vector<double>{10.0, 2e-3, 2e4}));
  const Model memory(estimator::testing::model_of({effect("bouc_wen_hysteresis")}));
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(3);
  motion[1] = 0.01;
  ImposedMotion loop(memory, 1.0, motion, 256);
  ASSERT_TRUE(loop.at(std::vector<double>{2.0, 1e-3, 0.5, 1.3}));
  MotionIntegrator fresh(model, cosine(1024, 1, true), false);
  ASSERT_TRUE(fresh.at(kHysteresisBehindPlay));
  MotionIntegrator begun(model, cosine(1024, 1, true), false);
  begun.begin_from(behind_play);
  begun.begin_from("bouc_wen_hysteresis.s", loop.force() / 2.0);
  ASSERT_TRUE(begun.at(kHysteresisBehindPlay));
  EXPECT_LT((begun.force() - fresh.force()).norm(), 1e-8 * fresh.force().norm());
}

// A linear damper behind a joint, against its complex stiffness: of twice the steps an eighth of the
// error.
TEST(MotionIntegrator, FollowsADamperBehindAJointToThirdOrder) {
  using estimator::testing::effect;
  auto joint = effect("series_compliance");
  joint.in_series = true;
  const Model model(
      estimator::testing::model_of({effect("viscous_damping"), effect("linear_stiffness"), joint}));
  const std::complex<double> damper(60.0, kTwoPi * 8.0), both = damper * 200.0 / (damper + 200.0);
  const auto error_of = [&](int points) {
    MotionIntegrator integrator(model, cosine(points, 1, true), false);
    EXPECT_TRUE(integrator.at(std::vector<double>{8.0, 60.0, 200.0}));
    double worst = 0.0;
    for (int i = 0; i < points; ++i) {
      const double force = (both * std::polar(0.01, kTwoPi * i / points)).real();
      worst = std::max(worst, std::fabs(integrator.force()[i] - force));
    }
    return worst / (0.01 * std::abs(both));
  };
  const double coarse = error_of(64), fine = error_of(128);
  EXPECT_LT(coarse, 1e-4);
  EXPECT_LT(fine, coarse / 6.0);
}

// Where the search begins does not change the solution.
TEST(ImposedMotion, BeginsFromTheMemoryOfAnotherModelOnAnotherGrid) {
  using estimator::testing::effect;
  const Model smaller(estimator::testing::model_of({effect("bouc_wen_hysteresis")}));
  const Model larger(estimator::testing::model_of(
      {effect("viscous_damping"), effect("bouc_wen_hysteresis"), effect("presliding_friction")}));
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(3);
  motion[1] = 0.002;
  ImposedMotion coarse(smaller, 1.0, motion, 128);
  ASSERT_TRUE(coarse.at(std::vector<double>{2.0, 1e-3, 0.5, 1.3}));
  ImposedMotion fresh(larger, 1.0, motion, 256), begun(larger, 1.0, motion, 256);
  begun.start_from(coarse);
  for (const double gamma : {0.5, 0.6, -0.2}) {
    const std::vector<double> theta = {5.0, 2.0, 1e-3, gamma, 1.3, 0.5, 5e-4};
    ImposedMotion anew(larger, 1.0, motion, 256);
    for (ImposedMotion* imposed : {&fresh, &begun, &anew})
      ASSERT_TRUE(imposed->at(theta)) << gamma;
    for (const ImposedMotion* imposed : {&fresh, &begun}) {
      EXPECT_LT((imposed->force() - anew.force()).norm(), 1e-7 * anew.force().norm()) << gamma;
      EXPECT_LT((imposed->slope() - anew.slope()).norm(), 1e-6 * anew.slope().norm()) << gamma;
    }
  }
}

// A campaign on a dynamometer: viscous damping and the presliding friction of a seal.
TEST(ImposedMotion, NamesTheHysteresisOfADynamometersDamper) {
  std::mt19937_64 source(5);
  std::normal_distribution<double> normal;
  Campaign campaign;
  struct Setting {
    double frequency, amplitude;
  };
  for (const auto& [frequency, amplitude] :
       std::vector<Setting>{{0.5, 0.02}, {1.0, 0.01}, {3.0, 0.004}}) {
    Recording r;
    r.name = "f" + std::to_string(campaign.runs.size());
    r.kind = Kind::imposed_motion;
    r.frequency_hz = frequency;
    const int n = 400;
    std::vector<double> u;
    for (int i = 0; i < 100 * n; ++i)
      u.push_back(amplitude * std::cos(kTwoPi * i / (100.0 * n)));
    const auto friction = friction_force(u, 0.8, 1e-3);
    for (int i = 0; i < 12 * n; ++i) {
      const double v = -kTwoPi * frequency * amplitude * std::sin(kTwoPi * i / n);
      r.t.push_back(i / (n * frequency));
      r.displacement.push_back(u[static_cast<std::size_t>(100 * (i % n))]);
      r.force.push_back(2.0 * v + friction[static_cast<std::size_t>(100 * (i % n))] +
                        0.01 * normal(source));
    }
    campaign.runs.push_back(std::move(r));
  }
  const auto d = diagnose(
      campaign, estimator::testing::model_of({estimator::testing::effect("viscous_damping")}));
  ASSERT_TRUE(d) << d.error().what;
  // Bouc-Wen hysteresis with n = 1 and c = 0 is equivalent, with two parameters more.
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "presliding_friction");
  for (const ParameterEstimate& p : d->effects[0].parameters) {
    const double truth = p.name == "f_c" ? 0.8 : 1e-3;
    EXPECT_NEAR(p.value, truth, 4.0 * p.standard_error) << p.name;
  }
  EXPECT_LT(d->gap.after, 1.1 * d->gap.noise_floor);
}

// The sensor of the motion is noisy too, and the damper turns this noise into force.
TEST(ImposedMotion, TakesNoiseOfTheMotionsSensorForNothingElse) {
  std::mt19937_64 source(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 4; ++trial) {
    Campaign campaign;
    for (const double frequency : {0.5, 1.0, 2.0, 4.0}) {
      Recording r;
      r.name = "f" + std::to_string(campaign.runs.size());
      r.kind = Kind::imposed_motion;
      r.frequency_hz = frequency;
      for (int i = 0; i < 10 * 200; ++i) {
        const double phase = kTwoPi * i / 200.0;
        const double v = -kTwoPi * frequency * 0.02 * std::sin(phase);
        r.t.push_back(i / (200.0 * frequency));
        r.displacement.push_back(0.05 + 0.02 * std::cos(phase) + 1e-4 * normal(source));
        r.force.push_back(3.0 * v + 40.0 * 0.02 * std::cos(phase) + 0.01 * normal(source));
      }
      campaign.runs.push_back(std::move(r));
    }
    auto spec = estimator::testing::model_of({estimator::testing::effect("viscous_damping"),
                                              estimator::testing::effect("linear_stiffness")});
    spec.effects[1].constants["u0"] = 0.05;
    const auto d = diagnose(campaign, spec);
    ASSERT_TRUE(d) << d.error().what;
    EXPECT_EQ(d->verdict, Verdict::adequate) << trial;
    EXPECT_LT(d->gap.before, 1.6 * d->gap.noise_floor) << trial;
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
