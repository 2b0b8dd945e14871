// Simulates the average run length between false alarms of the change detector and fits the
// line that glr_threshold uses.
//
//   build/bench/bench_glr [repetitions]
//
// The scores are independent and standard normal. The detector is the real one, with its
// candidates, its check of the scatter and its reference of at least 12 cycles.
#include <cmath>
#include <cstdlib>
#include <random>

#include <fmt/format.h>

#include "estimator/online/internal/change_detector.hpp"

using namespace shaker::estimator::online;

namespace {

double run_length(int parameters, double threshold, int repetitions, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  double cycles = 0.0;
  for (int r = 0; r < repetitions; ++r) {
    ChangeDetector detector(parameters, threshold);
    const Eigen::MatrixXd information = Eigen::MatrixXd::Identity(parameters, parameters);
    Eigen::VectorXd score(parameters);
    bool quiet = true;
    for (long k = 0; quiet; ++k) {
      for (int j = 0; j < parameters; ++j)
        score[j] = normal(random);
      quiet = !detector.add(score, information);
      cycles += 1.0;
    }
  }
  return cycles / repetitions;
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 200;
  for (int p = 1; p <= 8; ++p) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0, n = 0;
    for (const double threshold : {14.0, 18.0, 22.0}) {
      const double length = run_length(p, threshold, repetitions, 7);
      const double x = std::log(length);
      sx += x, sy += threshold, sxx += x * x, sxy += x * threshold, n += 1;
      fmt::print("{} parameters, threshold {:g}: {:.0f} cycles between false alarms\n", p,
                 threshold, length);
    }
    const double b = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    fmt::print("{} parameters: threshold = {:.3f} + {:.3f} ln(cycles)\n", p, (sy - b * sx) / n, b);
  }
}
