#include "estimator/fit/objectives/channels.hpp"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "estimator/model/run_models.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator {
namespace {

// From tests/data/channels/reference.py, with independent integration and sensitivities.
struct Case {
  const char* name;
  config::ModelSpec model;
  std::vector<Quantity> quantities;
};

std::vector<Case> cases() {
  using enum Quantity;
  return {{"linear", testing::linear_oscillator(), {displacement, absolute_acceleration}},
          {"oleo", testing::oleo(), {displacement, absolute_acceleration, damper_force}},
          {"tyre", testing::oleo_on_tyre(0.1), {displacement, absolute_acceleration}}};
}

nlohmann::json reference(const std::string& name) {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "channels" / "reference.json");
  return nlohmann::json::parse(file).at(name);
}

// The parameters 3 % above the truth.
std::vector<double> start_near(const nlohmann::json& truth) {
  std::vector<double> start = truth.get<std::vector<double>>();
  for (double& value : start)
    value *= 1.03;
  return start;
}

ChannelRun measured(const std::string& name, const nlohmann::json& from, std::size_t channels) {
  ChannelRun run;
  run.frequency_hz = from.at("frequency_hz");
  run.amplitude = from.at("amplitude");
  run.channels.resize(channels);
  for (const auto& row : testing::read_csv("channels/" + name + ".csv")) {
    for (std::size_t b = 0; b < channels; ++b)
      run.channels[b].push_back(row[1 + b]);
  }
  return run;
}

TEST(Channels, EndAtTheLikeliestParametersOfIndependentCode) {
  for (const Case& c : cases()) {
    const auto known = reference(c.name);
    const Model model(c.model);
    const ChannelRun run = measured(c.name, known, c.quantities.size());
    for (const bool joint : {false, true}) {
      SCOPED_TRACE(std::string(c.name) + (joint ? " joint" : " independent"));
      const auto& answer = known.at(joint ? "joint" : "independent");
      ChannelOptions options;
      if (model.coordinates() > 1) options.grid.points = 960;  // the tyre's own motion is fast
      options.noise = joint ? NoiseModel::joint : NoiseModel::independent;
      const ChannelFit found =
          fit_channels(model, c.quantities, {run}, start_near(known.at("truth")), options);
      ASSERT_EQ(found.fit.status, FitStatus::converged) << found.fit.trouble;
      const std::vector<double> theta = answer.at("theta"), error = answer.at("information_error");
      for (std::size_t k = 0; k < theta.size(); ++k) {
        EXPECT_NEAR(found.fit.theta[k], theta[k], 2e-4 * error[k]) << k;
        // The library also counts the parameters that each channel uses, so its error is
        // larger.
        EXPECT_GT(found.fit.standard_error[k], 0.999 * error[k]) << k;
        EXPECT_LT(found.fit.standard_error[k], 1.15 * error[k]) << k;
      }
      EXPECT_NEAR(found.log_likelihood, answer.at("log_likelihood").get<double>(), 1e-4);
      const std::vector<std::vector<double>> v = answer.at("covariance");
      const std::size_t m = v.size();
      for (std::size_t a = 0; a < m; ++a) {
        for (std::size_t b = 0; b < m; ++b)
          EXPECT_NEAR(found.likely_covariance[a * m + b], v[a][b],
                      1e-5 * std::sqrt(v[a][a] * v[b][b]));
      }
    }
  }
}

TEST(Channels, AreFittedAlikeStagewiseAndAllAtOnce) {
  for (const Case& c : cases()) {
    const auto known = reference(c.name);
    const Model model(c.model);
    const ChannelRun run = measured(c.name, known, c.quantities.size());
    for (const NoiseModel noise : {NoiseModel::independent, NoiseModel::joint}) {
      ChannelOptions options;
      options.noise = noise;
      const auto start = start_near(known.at("truth"));
      const ChannelFit once = fit_channels(model, c.quantities, {run}, start, options);
      options.stagewise = true;
      const ChannelFit stages = fit_channels(model, c.quantities, {run}, start, options);
      ASSERT_EQ(stages.fit.status, FitStatus::converged) << c.name << stages.fit.trouble;
      EXPECT_GT(stages.stages, 1);
      for (std::size_t k = 0; k < start.size(); ++k)
        EXPECT_NEAR(stages.fit.theta[k], once.fit.theta[k], 1e-4 * once.fit.standard_error[k]);
    }
  }
}

TEST(Channels, OfOneDisplacementAreLeastSquares) {
  const Model model(testing::oleo());
  const auto known = reference("oleo");
  ChannelRun run = measured("oleo", known, 1);
  RunData data;
  data.frequency_hz = run.frequency_hz;
  data.amplitude = run.amplitude;
  data.displacement = run.channels[0];
  const auto start = start_near(known.at("truth"));
  Estimator estimator(model, {data});
  const Fit& squares = estimator.fit(start);
  const Quantity one[] = {Quantity::displacement};
  const ChannelFit found = fit_channels(model, one, {run}, start);
  for (std::size_t k = 0; k < start.size(); ++k) {
    EXPECT_NEAR(found.fit.theta[k], squares.theta[k], 1e-5 * squares.standard_error[k]);
    EXPECT_NEAR(found.fit.standard_error[k] / squares.standard_error[k], 1.0, 1e-5);
  }
  EXPECT_NEAR(found.fit.noise / squares.noise, 1.0, 1e-6);  // (3.28)
}

TEST(Channels, HaveTheirOwnValuesInTheirRuns) {
  config::ModelSpec spec = testing::oleo();
  spec.effects[1].parameters["theta2"].variation.per = "run";
  const std::vector<config::RunCondition> conditions = {{"a", "", {}}, {"b", "", {}}};
  const auto models = run_models(spec, conditions);
  ASSERT_TRUE(models) << models.error().what;
  const Model single(testing::oleo());
  const double preloads[] = {1.5, 1.7};
  std::vector<ChannelRun> runs;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 2e-5);
  std::vector<double> theta = testing::kOleoSi;
  for (std::size_t r = 0; r < 2; ++r) {
    theta[1] = preloads[r];
    PeriodicSystem system(single, {Scheme::fourier, 320, false});
    const double f = r == 0 ? 2.0 : 1.0;
    system.set_excitation(f, 3.048);
    ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
    ChannelRun run;
    run.frequency_hz = f;
    run.amplitude = 3.048;
    run.channels.emplace_back();
    for (int i = 0; i < 64; ++i)
      run.channels[0].push_back(system.value(5 * i, 0) + noise(random));
    run.model = models->of_run[r];
    runs.push_back(std::move(run));
  }
  const Quantity one[] = {Quantity::displacement};
  const std::vector<double> start = models->joint().start();
  const ChannelFit found = fit_channels(models->joint(), one, std::move(runs), start);
  ASSERT_EQ(found.fit.status, FitStatus::converged) << found.fit.trouble;
  for (const std::size_t k : {1U, 2U}) {
    const double error = found.fit.standard_error[k];
    EXPECT_NEAR(found.fit.theta[k], preloads[k - 1], 4.0 * error);
    EXPECT_LT(error, 0.03);
  }
}

// Two identical dampers: the error of the spring equals that with one damper.
TEST(Channels, KnowWhatIsDeterminedBesideWhatIsNot) {
  const Case linear = cases()[0];
  const ChannelRun run = measured("linear", reference("linear"), linear.quantities.size());
  auto spec = linear.model;
  const Model one(spec);
  spec.effects.insert(spec.effects.begin(), spec.effects[0]);
  const Model two(spec);
  const auto start = start_near(reference("linear").at("truth"));
  const ChannelFit alone = fit_channels(one, linear.quantities, {run}, start);
  const ChannelFit alike =
      fit_channels(two, linear.quantities, {run}, {0.5 * start[0], 0.5 * start[0], start[1]});
  EXPECT_EQ(alike.fit.status, FitStatus::undetermined);
  EXPECT_FALSE(alike.fit.determined[0]);
  EXPECT_FALSE(alike.fit.determined[1]);
  EXPECT_TRUE(std::isnan(alike.fit.standard_error[0]));
  ASSERT_TRUE(alike.fit.determined[2]);
  EXPECT_NEAR(alike.fit.theta[2] / alone.fit.theta[1], 1.0, 1e-7);
  EXPECT_NEAR(alike.fit.standard_error[2] / alone.fit.standard_error[1], 1.0, 1e-5);
  EXPECT_NEAR(alike.fit.quantile, alone.fit.quantile, 1e-5);
}

TEST(Channels, CountForWhatTheyAreWorthWhateverTheirUnits) {
  const Model model(testing::oleo());
  const auto known = reference("oleo");
  const ChannelRun run = measured("oleo", known, 2);
  const Quantity both[] = {Quantity::displacement, Quantity::absolute_acceleration};
  const auto start = start_near(known.at("truth"));
  const ChannelFit two = fit_channels(model, both, {run}, start);
  const ChannelFit one = fit_channels(model, {both, 1}, {measured("oleo", known, 1)}, start);
  for (std::size_t k = 0; k < start.size(); ++k)
    EXPECT_LT(two.fit.standard_error[k], one.fit.standard_error[k]);
  // With the most likely variances as known ones, the parameters are the most likely ones.
  ChannelOptions options;
  options.noise = NoiseModel::known;
  options.known_covariance = two.likely_covariance;
  const ChannelFit weighted = fit_channels(model, both, {run}, start, options);
  for (std::size_t k = 0; k < start.size(); ++k)
    EXPECT_NEAR(weighted.fit.theta[k], two.fit.theta[k], 1e-5 * two.fit.standard_error[k]);
}

// The fraction of the repetitions whose intervals contain the truth, for each parameter. The
// noise of the two channels is correlated, and the harmonics of the table's accelerometer have
// the error `excitation_error`; the fit is told `stated`.
std::vector<double> coverage(const Model& model, const std::vector<double>& truth, double amplitude,
                             const std::array<double, 2>& noise, double excitation_error,
                             double stated, int count = 2000) {
  count = repetitions(count);
  constexpr int kPoints = 40;
  const Quantity both[] = {Quantity::displacement, Quantity::absolute_acceleration};
  PeriodicSystem system(model, {Scheme::order6, 160, true});
  system.set_channels(both);
  system.set_excitation(2.0, amplitude);
  EXPECT_EQ(system.solve_from_rest(truth).status, SolveStatus::converged);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<double> inside(truth.size(), 0.0);
  for (int repetition = 0; repetition < count; ++repetition) {
    ChannelRun run;
    run.frequency_hz = 2.0;
    run.excitation_error = stated;
    run.channels.resize(2);
    run.excitation.assign(kPoints, 0.0);
    for (int h = 1; h <= 3; ++h) {
      const double c = (h == 1 ? amplitude : 0.0) + excitation_error * normal(random);
      const double s = excitation_error * normal(random);
      for (int i = 0; i < kPoints; ++i) {
        const double angle = 2.0 * M_PI * h * i / kPoints;
        run.excitation[static_cast<std::size_t>(i)] += c * std::cos(angle) + s * std::sin(angle);
      }
    }
    for (int i = 0; i < kPoints; ++i) {
      const double shared = normal(random), own = normal(random);
      run.channels[0].push_back(system.observed(4 * i, 0) + noise[0] * shared);
      run.channels[1].push_back(system.observed(4 * i, 1) + noise[1] * (0.6 * shared + 0.8 * own));
    }
    ChannelOptions options;
    options.noise = NoiseModel::joint;
    const ChannelFit found = fit_channels(model, both, {run}, truth, options);
    if (found.fit.status != FitStatus::converged) continue;  // counts as a miss
    for (std::size_t k = 0; k < truth.size(); ++k)
      inside[k] += (std::fabs(found.fit.theta[k] - truth[k]) <=
                    found.fit.quantile * found.fit.standard_error[k]) /
                   static_cast<double>(count);
  }
  return inside;
}

// Three times the binomial scatter of 2000 repetitions.
constexpr double kTolerance = kSanitized ? 0.15 : 0.015;

TEST(Channels, StateErrorsThatCoverTheTruth) {
  const std::vector<double> oscillator = reference("linear").at("truth");
  for (const double share :
       coverage(Model(testing::linear_oscillator()), oscillator, 3.0, {2e-4, 3e-2}, 0.0, 0.0))
    EXPECT_NEAR(share, 0.95, kTolerance);
  for (const double share :
       coverage(Model(testing::oleo()), testing::kOleoSi, 3.048, {2e-5, 5e-3}, 0.0, 0.0))
    EXPECT_NEAR(share, 0.95, kTolerance);
}

// Slightly above 95 %: part of the effect of the excitation's error is in the residuals too,
// and is counted twice.
TEST(Channels, CountTheNoiseOfTheExcitation) {
  const Model model(testing::oleo());
  for (const double share : coverage(model, testing::kOleoSi, 3.048, {2e-5, 5e-3}, 3e-3, 3e-3)) {
    EXPECT_GT(share, 0.955 - kTolerance);
    EXPECT_LT(share, kSanitized ? 1.1 : 0.985);
  }
  if (kSanitized) return;  // too few repetitions for the checks below
  for (const double share : coverage(model, testing::kOleoSi, 3.048, {2e-5, 5e-3}, 3e-3, 0.0, 200))
    EXPECT_LT(share, 0.8) << "the case shows nothing";
}

TEST(Channels, RejectDataThatCannotBeUsed) {
  const Model model(testing::oleo());
  const Quantity both[] = {Quantity::displacement, Quantity::absolute_acceleration};
  ChannelRun run = measured("oleo", reference("oleo"), 2);
  const auto refused = [&](const ChannelRun& bad) {
    EXPECT_THROW(fit_channels(model, both, {bad}, model.start()), std::invalid_argument);
  };
  ChannelRun bad = run;
  bad.channels[1].pop_back();
  refused(bad);
  bad = run;
  bad.channels[0][3] = std::nan("");
  refused(bad);
  bad = run;
  bad.channels.pop_back();
  refused(bad);
}

}  // namespace
}  // namespace shaker::estimator
