// Measures how often the change detector names the parameter that did change, alone or among
// its alternatives, and how many parameters it names.
//
//   build/bench/bench_names [repetitions]
//
// Scores x ~ N(L d, s^2 L), where L is the information of one cycle of the linear oscillator,
// the oleo or the oleo on its tyre (40 points with noise of 2e-5 m). One parameter jumps after
// 100 cycles.
#include <cmath>
#include <cstdlib>
#include <random>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "config/model.hpp"
#include "estimator/online/internal/change_detector.hpp"
#include "estimator/online/internal/cycle_predictor.hpp"
#include "tests/estimator/fixtures.hpp"

using namespace shaker::estimator;

namespace {

struct Case {
  const char* name;
  shaker::config::ModelSpec spec;
  std::vector<double> theta;
  double frequency_hz, amplitude;
};

std::vector<Case> cases() {
  std::vector<double> tyre = testing::kOleoSi;
  tyre.insert(tyre.end(), {900.0, 3.0});
  return {{"linear oscillator, 2 Hz", testing::linear_oscillator(), {2.0, 120.0}, 2.0, 3.0},
          {"oleo, 2 Hz", testing::oleo(), testing::kOleoSi, 2.0, 3.048},
          {"oleo, 1.5 Hz", testing::oleo(), testing::kOleoSi, 1.5, 2.0},
          {"oleo on its tyre, 2 Hz", testing::oleo_on_tyre(0.1), tyre, 2.0, 3.048}};
}

struct Score {
  int alarms = 0, first = 0, named = 0, names = 0;
};

Score jumped(const Eigen::MatrixXd& information, Eigen::Index parameter, double size,
             int repetitions) {
  const Eigen::Index p = information.rows();
  const double threshold = online::glr_threshold(1e-4, static_cast<int>(p));
  const Eigen::MatrixXd root = information.llt().matrixL();
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(p);
  // `size` is in standard errors of the parameter from one cycle when no other parameter may
  // change.
  moved[parameter] = size / std::sqrt(information(parameter, parameter));
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal;
  Score score;
  for (int r = 0; r < repetitions; ++r) {
    online::ChangeDetector detector(static_cast<int>(p), threshold);
    for (int k = 0; k < 400; ++k) {
      Eigen::VectorXd white(p);
      for (double& value : white)
        value = normal(random);
      Eigen::VectorXd x = root * white;
      if (k >= 100) x += information * moved;
      const auto change = detector.add(x, information);
      if (change && k < 100) break;
      if (!change) continue;
      ++score.alarms;
      score.names += 1 + static_cast<int>(change->alternatives.size());
      bool named = change->parameter == parameter;
      score.first += named ? 1 : 0;
      for (const auto& other : change->alternatives)
        named = named || other.parameter == parameter;
      score.named += named ? 1 : 0;
      break;
    }
  }
  return score;
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 400;
  for (const Case& c : cases()) {
    const Model model(c.spec);
    online::CyclePredictor predictor(model, 160);
    MeasuredCycle cycle;
    cycle.frequency_hz = c.frequency_hz;
    cycle.amplitude = c.amplitude;
    cycle.displacement.assign(40, 0.0);
    online::Prediction at;
    if (!predictor.predict(cycle, c.theta, false, at)) return 1;
    const Eigen::MatrixXd information = at.jacobian.transpose() * at.jacobian / 4e-10;
    for (const double size : {1.0, 3.0, 10.0}) {
      fmt::print("{}, {:g} standard errors:", c.name, size);
      for (Eigen::Index k = 0; k < information.rows(); ++k) {
        const Score s = jumped(information, k, size, repetitions);
        const double n = std::max(1, s.alarms);
        fmt::print("  {} {:.1f}/{:.1f} % of {:.1f}",
                   model.parameters()[static_cast<std::size_t>(k)].name, 100.0 * s.first / n,
                   100.0 * s.named / n, s.names / n);
      }
      fmt::print("\n");
    }
  }
}
