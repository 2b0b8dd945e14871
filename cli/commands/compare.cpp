// Compares the optimisers on one data set: iterations, periodic solutions and time; parameters,
// sum of squares and status.
#include <chrono>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "estimator/paper/figures.hpp"
#include "estimator/paper/optimisers/methods.hpp"
#include "estimator/paper/optimisers/periodic_problem.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace optimisers = estimator::optimisers;

constexpr int kMostEvaluations = 5000;

struct Row {
  const optimisers::Method* method = nullptr;
  optimisers::Summary summary;
  long solutions = 0;
  double seconds = 0.0;
};

struct Comparison {
  std::vector<std::string> names;  // of the free parameters
  std::vector<double> start;
  int observations = 0;
  std::vector<Row> rows;
};

std::vector<const optimisers::Method*> wanted_methods(const std::vector<std::string>& names) {
  std::vector<const optimisers::Method*> list;
  if (names.empty()) {
    for (const optimisers::Method& method : optimisers::methods())
      list.push_back(&method);
  }
  for (const std::string& name : names) {
    const optimisers::Method* method = optimisers::find_method(name);
    if (method == nullptr) {
      std::vector<std::string_view> known;
      for (const optimisers::Method& one : optimisers::methods())
        known.push_back(one.name);
      throw std::invalid_argument(
          fmt::format("there is no method \"{}\"; choose from {}", name, fmt::join(known, ", ")));
    }
    list.push_back(method);
  }
  return list;
}

Comparison compare_all(const estimator::Model& model, const std::vector<estimator::RunData>& runs,
                       const estimator::EstimationOptions& grid, const CompareOptions& options,
                       const std::vector<double>& usual_start) {
  optimisers::PeriodicProblem problem(model, runs, grid);
  Comparison out;
  for (const auto& parameter : model.parameters()) {
    if (!parameter.fixed) out.names.push_back(parameter.name);
  }
  Eigen::VectorXd start = problem.reduce(usual_start);
  if (!options.start.empty()) {
    if (static_cast<int>(options.start.size()) != problem.parameters())
      throw std::invalid_argument(fmt::format("--start has {} values for {} free parameters ({})",
                                              options.start.size(), problem.parameters(),
                                              fmt::join(out.names, ", ")));
    start = Eigen::Map<const Eigen::VectorXd>(options.start.data(), problem.parameters());
    if ((start.array() < problem.lower().array()).any() ||
        (start.array() > problem.upper().array()).any())
      throw std::invalid_argument("--start lies outside the parameters' bounds");
  }
  out.start.assign(start.data(), start.data() + start.size());
  out.observations = problem.observations();
  optimisers::Options limits;
  limits.max_evaluations = kMostEvaluations;
  for (const optimisers::Method* method : wanted_methods(options.methods)) {
    problem.forget();
    const auto before = std::chrono::steady_clock::now();
    Row row{method, method->minimise(problem, start, limits), 0, 0.0};
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    row.solutions = problem.solutions();
    out.rows.push_back(std::move(row));
  }
  return out;
}

std::vector<double> plain(const Eigen::VectorXd& v) {
  return {v.data(), v.data() + v.size()};
}

void print_json(const Comparison& comparison) {
  OrderedJson rows = OrderedJson::array();
  for (const Row& row : comparison.rows) {
    rows.push_back({{"method", row.method->name},
                    {"equation", row.method->equation},
                    {"source", row.method->source},
                    {"status", optimisers::name(row.summary.status)},
                    {"iterations", row.summary.iterations},
                    {"evaluations", row.summary.evaluations},
                    {"refused", row.summary.refused},
                    {"periodic_solutions", row.solutions},
                    {"time_s", row.seconds},
                    {"sum_of_squares", row.summary.sum_of_squares},
                    {"theta", plain(row.summary.theta)}});
  }
  const OrderedJson document = {{"parameters", comparison.names},
                                {"start", comparison.start},
                                {"observations", comparison.observations},
                                {"methods", std::move(rows)}};
  fmt::print("{}\n", document.dump());
}

void print_table(const Comparison& comparison) {
  fmt::print("{} observations; start {:.5g}\n\n", comparison.observations,
             fmt::join(comparison.start, ", "));
  std::vector<std::vector<std::string>> table = {{"method", "by", "status", "iterations",
                                                  "solutions", "refused", "time/ms",
                                                  "sum of squares"}};
  for (const std::string& name : comparison.names)
    table.front().push_back(name);
  for (const Row& row : comparison.rows) {
    std::vector<std::string> cells = {std::string(row.method->name),
                                      std::string(row.method->source),
                                      std::string(optimisers::name(row.summary.status)),
                                      std::to_string(row.summary.iterations),
                                      std::to_string(row.solutions),
                                      std::to_string(row.summary.refused),
                                      fmt::format("{:.2f}", 1e3 * row.seconds),
                                      fmt::format("{:.6g}", row.summary.sum_of_squares)};
    for (const double value : plain(row.summary.theta))
      cells.push_back(fmt::format("{:.5g}", value));
    table.push_back(std::move(cells));
  }
  std::vector<bool> right(table.front().size(), true);
  right[0] = right[1] = right[2] = false;
  fmt::print("{}", report::text_table(table, right));
}

Comparison compare_figure(const CompareOptions& options) {
  const auto data = estimator::paper::data_of(options.figure);
  estimator::EstimationOptions grid;
  grid.grid = data.grid;
  return compare_all(estimator::Model(data.model), {data.run}, grid, options, data.start);
}

}  // namespace

int compare(const Common& common, const CompareOptions& options) {
  try {
    Comparison comparison;
    if (options.figure != 0) {
      comparison = compare_figure(options);
    } else {
      if (options.file().empty())
        return fail(common, kBadInput, "give a file to compare on, or --figure N");
      const auto input = read_estimation_input(options);
      if (!input) return fail(common, kBadInput, input.error().what);
      const estimator::Model model(input->model);
      comparison = compare_all(model, input->runs, {}, options, model.start());
    }
    common.json ? print_json(comparison) : print_table(comparison);
    for (const Row& row : comparison.rows) {
      if (row.summary.status == optimisers::Status::converged) return kOk;
    }
    if (!common.json) fmt::print(stderr, "shakerctl: no method converged\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput,
                options.file().empty()
                    ? std::string(error.what())
                    : fmt::format("{}: {}", options.file().string(), error.what()));
  }
}

}  // namespace shaker::cli
