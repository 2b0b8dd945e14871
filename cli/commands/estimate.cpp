// An estimate from a file: a campaign database, or one run as CSV.
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "estimator/estimation.hpp"
#include "estimator/optimise/periodic_problem.hpp"
#include "estimator/optimise/several_starts.hpp"
#include "estimator/worth/intervals.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

namespace optimise = estimator::optimise;

constexpr int kScreeningPoints = 80;  // coarse: the fit proper follows on the full grid

struct Search {
  optimise::Minima minima;
  std::vector<double> best;  // all parameters
};

Search search(const estimator::Model& model, const std::vector<estimator::RunData>& runs,
              const EstimateOptions& options) {
  estimator::EstimationOptions grid;
  grid.grid.points = kScreeningPoints;
  optimise::PeriodicProblem problem(model, runs, grid);
  optimise::StartOptions spread;
  spread.starts = options.starts;
  spread.seed = options.seed;
  Search out;
  out.minima = several_starts(problem, problem.reduce(model.start()),
                              *optimise::find_method("levenberg_marquardt"), {}, spread);
  out.best = out.minima.found.empty() ? model.start()
                                      : problem.expand(out.minima.found.front().summary.theta);
  return out;
}

nlohmann::ordered_json to_json(const optimise::Minima& minima) {
  auto list = nlohmann::ordered_json::array();
  for (const optimise::Minimum& minimum : minima.found) {
    const optimise::Summary& s = minimum.summary;
    list.push_back({{"theta", std::vector<double>(s.theta.data(), s.theta.data() + s.theta.size())},
                    {"sum_of_squares", s.sum_of_squares},
                    {"status", optimise::name(s.status)},
                    {"starts", minimum.hits}});
  }
  return list;
}

std::string minima_table(const optimise::Minima& minima, const estimator::Model& model) {
  std::vector<std::vector<std::string>> rows = {{"starts", "ended", "sum of squares"}};
  for (const auto& parameter : model.parameters()) {
    if (!parameter.fixed) rows.front().push_back(parameter.name);
  }
  for (const optimise::Minimum& minimum : minima.found) {
    rows.push_back({std::to_string(minimum.hits),
                    std::string(optimise::name(minimum.summary.status)),
                    fmt::format("{:.6g}", minimum.summary.sum_of_squares)});
    for (const double value : minimum.summary.theta)
      rows.back().push_back(fmt::format("{:.5g}", value));
  }
  return fmt::format("\nWhere the starts ended ({} of {} points looked at had a solution):\n\n{}",
                     minima.admissible, minima.looks,
                     report::text_table(rows, std::vector<bool>(rows.front().size(), true)));
}

}  // namespace

int estimate(const Common& common, const EstimateOptions& options) {
  if (options.loss != "squared" && options.intervals != "linear") {
    return fail(common, kBadInput,
                fmt::format("{} intervals belong to the squared loss; leave --loss or --intervals "
                            "out",
                            options.intervals));
  }
  auto input = read_estimation_input(options);
  if (!input) return fail(common, kBadInput, input.error().what);
  try {
    const estimator::Model model(input->model);
    std::optional<Search> searched;
    if (options.starts > 1) searched = search(model, input->runs, options);
    estimator::Estimator estimator(model, input->runs);
    const estimator::Fit& fit = estimator.fit(searched ? searched->best : model.start());
    if (fit.status == estimator::FitStatus::no_solution) {
      return fail(common, kNotUsable, fit.trouble);
    }
    estimator::Estimate estimate = estimator.describe();
    const auto loss = *estimator::loss_from_name(options.loss);
    if (loss != estimator::Loss::squared)
      replace_by_robust(estimate, fit_robust(model, input->runs, fit.theta, loss), model);
    replace_intervals(estimate, *estimator::interval_kind_from_name(options.intervals), model,
                      estimator, input->runs);
    protocol::EstimateDocument document = report::to_document(estimate);
    document.campaign = input->campaign;
    document.clock = "recorded";
    if (common.json && (searched || options.intervals != "linear" || options.loss != "squared")) {
      auto json = nlohmann::ordered_json::parse(protocol::to_json_text(document));
      if (searched) json["minima"] = to_json(searched->minima);
      json["intervals"] = options.intervals;
      json["loss"] = options.loss;
      fmt::print("{}\n", json.dump());
    } else {
      fmt::print("{}", common.json ? protocol::to_json_text(document) + "\n"
                                   : report::estimate_table(document));
      if (searched) fmt::print("{}", minima_table(searched->minima, model));
    }
    if (document.usable) return kOk;
    if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, fmt::format("{}: {}", options.file.string(), error.what()));
  }
}

}  // namespace shaker::cli
