// One of the jobs J1, J6, J7, J7_640, J7_10240, J8a, J8b, as a line of JSON: the median and the
// least CPU time of a fit from 5 % above the truth, and its error against the optimum. J1, J6 and
// J7 are also fitted once from each corner of the box 20 % around the truth: how many of these fits
// took the nested method, how many missed the optimum, and the longest of them.
//
//   build/bench/bench_jobs JOB FOLDER TIMES
//
// FOLDER holds the job's data and reference: oleo_j6.txt, oleo_j7.txt and their *_reference.txt,
// or what `bench/numpy_transient.py make` writes. J1 has both in tests/data. A fit begins with
// nothing but the data; memory and grids are ready. bench/against_numpy.py runs this program in
// turn with the same jobs in NumPy.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/oleo_in_feet.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/fit/records/transient.hpp"
#include "tests/estimator/benchmark_jobs.hpp"

namespace {

using namespace shaker;
using namespace shaker::estimator;
using Path = std::filesystem::path;
using Rows = std::vector<std::vector<double>>;

// Numbers separated by blanks or commas, row by row; words are left out.
Rows rows_of(const Path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  Rows rows;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (*end == '\0') row.push_back(value);
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<double> column_of(const Rows& rows, std::size_t column) {
  std::vector<double> values;
  for (const auto& row : rows)
    values.push_back(row.at(column));
  return values;
}

Model example(const std::string& name, bool presliding = false) {
  auto spec = config::load_model(Path(SHAKER_SOURCE_DIR) / "config/examples" / name);
  if (!spec) throw std::runtime_error(spec.error().what);
  if (presliding) {
    config::EffectSpec friction;
    friction.effect = "presliding_friction";
    friction.parameters["f_c"].start = 0.5;
    friction.parameters["z0"].start = 0.001;
    spec->effects.push_back(friction);
  }
  return Model(*spec);
}

std::vector<double> five_percent_above(std::vector<double> truth) {
  for (double& value : truth)
    value *= 1.05;
  return truth;
}

// A job made ready: `fit` runs it once from a start. The reference may hold more than the
// parameters. Without `corners` a job is only run from `start`.
struct Job {
  std::vector<double> reference;
  std::vector<double> start;  // 5 % above the truth
  std::function<const Fit&(const std::vector<double>&)> fit;
  bool corners = false;
};

RunData run_of(double frequency, std::vector<double> displacement) {
  RunData run;
  run.frequency_hz = frequency;
  run.amplitude = 3.0;
  run.displacement = std::move(displacement);
  return run;
}

Job periodic(Model model, std::vector<RunData> runs, int points, std::vector<double> reference) {
  const auto kept = std::make_shared<Model>(std::move(model));
  const auto estimator =
      std::make_shared<Estimator>(*kept, std::move(runs), bench::on_points(points));
  return {std::move(reference), five_percent_above(kept->start()),
          [kept, estimator](const std::vector<double>& start) -> const Fit& {
            return estimator->fit(start);
          },
          true};
}

Job transient(const Path& folder, const std::string& name) {
  const auto model = std::make_shared<Model>(example("model-oleo.json"));
  const Rows rows = rows_of(folder / (name + ".csv"));
  TransientRecord record;
  record.t = column_of(rows, 0);
  record.displacement = column_of(rows, rows.front().size() - 1);
  if (rows.front().size() == 3)
    record.excitation = Excitation::sampled(record.t, column_of(rows, 1));
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  options.tolerance = 1e-8;
  const auto estimator =
      std::make_shared<TransientEstimator>(*model, std::vector{std::move(record)}, options);
  return {column_of(rows_of(folder / (name + "_reference.txt")), 0),
          five_percent_above(model->start()),
          [model, estimator](const std::vector<double>& start) -> const Fit& {
            return estimator->fit(start);
          }};
}

Job job_of(const std::string& name, const Path& folder) {
  if (name == "J1") {
    const auto estimator = std::make_shared<Estimator>(
        bench::model(), std::vector{estimator::testing::job1()}, bench::on_points(80));
    return {rows_of(Path(SHAKER_TEST_DATA) / "oleo_j1_reference.csv").front(), bench::kStart,
            [estimator](const std::vector<double>& start) -> const Fit& {
              return estimator->fit(start);
            },
            true};
  }
  if (name == "J6") {
    const auto y = column_of(rows_of(folder / "oleo_j6.txt"), 0);
    return periodic(
        example("model-oleo-on-tyre.json"),
        {run_of(2.0, {y.begin(), y.begin() + 40}), run_of(4.0, {y.begin() + 40, y.end()})}, 160,
        column_of(rows_of(folder / "oleo_j6_reference.txt"), 0));
  }
  if (name == "J7" || name == "J7_640" || name == "J7_10240") {
    return periodic(example("model-oleo.json", true),
                    {run_of(2.0, column_of(rows_of(folder / "oleo_j7.txt"), 0))},
                    name == "J7" ? 1600 : std::stoi(name.substr(3)),
                    column_of(rows_of(folder / "oleo_j7_reference.txt"), 0));
  }
  if (name == "J8a" || name == "J8b") return transient(folder, name);
  throw std::runtime_error(name + ": no such job; J1, J6, J7, J7_640, J7_10240, J8a, J8b");
}

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double error_of(const Fit& fit, const std::vector<double>& reference) {
  double error = 0.0;
  for (std::size_t k = 0; k < fit.theta.size(); ++k)
    error = std::max(error, std::fabs(fit.theta[k] / reference.at(k) - 1.0));
  return error;
}

// The fits from all corners of the box 20 % around the truth.
struct Corners {
  int fits = 0, nested = 0, missed = 0;
  double longest_ms = 0.0;
};

Corners corners_of(const Job& job) {
  Corners corners;
  if (!job.corners) return corners;
  for (corners.fits = 0; corners.fits < 1 << job.start.size(); ++corners.fits) {
    std::vector<double> start = job.start;
    for (std::size_t k = 0; k < start.size(); ++k)
      start[k] *= ((corners.fits >> k & 1) != 0 ? 1.2 : 0.8) / 1.05;
    const double began = cpu_ms();
    const Fit& fit = job.fit(start);
    corners.longest_ms = std::max(corners.longest_ms, cpu_ms() - began);
    corners.nested += fit.nested ? 1 : 0;
    corners.missed += error_of(fit, job.reference) < 1e-3 ? 0 : 1;
  }
  return corners;
}

void run(const std::string& name, const Path& folder, int times) {
  const Job job = job_of(name, folder);
  const Fit* fit = nullptr;
  std::vector<double> taken;
  for (int i = 0; i < times; ++i) {
    const double began = cpu_ms();
    fit = &job.fit(job.start);
    taken.push_back(cpu_ms() - began);
  }
  std::sort(taken.begin(), taken.end());
  std::printf(
      "{\"job\": \"%s\", \"median_ms\": %.6g, \"least_ms\": %.6g, \"error\": %.3g, "
      "\"iterations\": [%d], \"converged\": %s, \"nested\": %s",
      name.c_str(), taken[taken.size() / 2], taken.front(), error_of(*fit, job.reference),
      fit->iterations, fit->status == FitStatus::converged ? "true" : "false",
      fit->nested ? "true" : "false");
  const Corners corners = corners_of(job);
  if (corners.fits > 0)
    std::printf(
        ", \"corners\": {\"fits\": %d, \"nested\": %d, \"missed\": %d, \"longest_ms\": %.4g}",
        corners.fits, corners.nested, corners.missed, corners.longest_ms);
  std::printf("}\n");
}

}  // namespace

int main(int count, char** words) {
  try {
    const int times = count == 4 ? std::atoi(words[3]) : 0;
    if (times < 1) throw std::runtime_error("usage: bench_jobs JOB FOLDER TIMES");
    run(words[1], words[2], times);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
