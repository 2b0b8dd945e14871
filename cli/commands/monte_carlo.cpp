// Estimates the same campaign many times with new noise and reports bias, scatter and coverage.
#include "estimator/inference/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/commands/monte_carlo_parts.hpp"
#include "config/model.hpp"
#include "estimator/paper/figures.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace est = shaker::estimator;

struct Case {
  config::ModelSpec model;
  est::MonteCarloOptions options;
};

// The experiments of the paper with its noise: uniform, 1 % of the largest stroke. Figure 11
// has no noise; here it gets a tenth of that noise.
Result<Case> figure_case(int figure) {
  constexpr double kGravity = 32.178, kSqrt3 = 1.7320508075688772;
  Case c;
  c.model = est::paper::oleo_in_feet(kGravity);
  c.options.truth = est::paper::kExactTheta;
  c.options.kind = est::NoiseKind::uniform;
  est::RunDesign run{2.0, 10.0, 40, 1.0};
  double largest = 0.5698, share = 0.01;
  switch (figure) {
    case 11:
      share = 0.001;
      break;
    case 12:
      break;
    case 13:
      run.amplitude = 5.0;
      largest = 0.5488;
      break;
    case 14:
      run.frequency_hz = 1.0;
      largest = 0.5566;
      break;
    default:
      return Error{ErrorKind::invalid,
                   fmt::format("there is no figure {} here; there are 11, 12, 13 and 14", figure)};
  }
  c.options.runs = {run};
  c.options.noise = share * largest / kSqrt3;
  return c;
}

Result<Case> own_case(const MonteCarloCommand& command) {
  const auto bad = [](std::string why) { return Error{ErrorKind::invalid, std::move(why)}; };
  if (command.model.empty()) return bad("give a model file, or --figure");
  if (command.frequencies_hz.empty()) return bad("give the runs' frequencies with --frequency");
  if (command.amplitudes.size() != command.frequencies_hz.size() && command.amplitudes.size() != 1)
    return bad(
        fmt::format("{} frequencies and {} amplitudes; give one amplitude a frequency, or "
                    "one for all",
                    command.frequencies_hz.size(), command.amplitudes.size()));
  if (!(command.noise > 0.0))
    return bad(
        "give the standard deviation of one sample's noise with --noise, in the model's "
        "length unit");
  auto model = config::load_model(command.model);
  if (!model) return model.error();
  Case c;
  c.model = std::move(*model);
  c.options.noise = command.noise;
  c.options.kind = command.uniform ? est::NoiseKind::uniform : est::NoiseKind::normal;
  for (std::size_t r = 0; r < command.frequencies_hz.size(); ++r) {
    const double amplitude = command.amplitudes[command.amplitudes.size() == 1 ? 0 : r];
    c.options.runs.push_back({command.frequencies_hz[r], amplitude, command.points,
                              static_cast<double>(command.cycles)});
  }
  return c;
}

OrderedJson to_json(const est::Model& model, const est::MonteCarloOptions& options,
                    const est::MonteCarloResult& result) {
  OrderedJson runs = OrderedJson::array(), parameters = OrderedJson::array();
  for (const est::RunDesign& run : options.runs)
    runs.push_back({{"frequency_hz", run.frequency_hz},
                    {"amplitude", run.amplitude},
                    {"points", run.points},
                    {"cycles", run.cycles}});
  for (const est::ParameterScore& p : result.parameters) {
    const auto& info = model.parameters()[static_cast<std::size_t>(p.parameter)];
    OrderedJson item = {{"name", info.name},
                        {"unit", info.unit},
                        {"truth", p.truth},
                        {"bias", p.bias},
                        {"scatter", p.scatter},
                        {"bound", p.bound},
                        {"second_order_bound", p.second_bound},
                        {"stated", p.stated},
                        {"coverage", p.coverage},
                        {"discretisation", p.discretisation}};
    if (options.profile) item["profile_coverage"] = p.profile_coverage;
    parameters.push_back(std::move(item));
  }
  return {{"model", model.name()},
          {"runs", std::move(runs)},
          {"noise", options.noise},
          {"replications", result.replications},
          {"converged", result.converged},
          {"undetermined", result.undetermined},
          {"on_bound", result.on_bound},
          {"bias", est::name(options.bias)},
          {"bias_taken_off", result.bias_taken_off},
          {"bias_left_in", result.bias_left_in},
          {"seed", options.seed},
          {"confidence", options.estimation.confidence},
          {"parameters", std::move(parameters)},
          {"covariance", result.covariance},
          {"bound_covariance", result.bound}};
}

void print(const est::Model& model, const est::MonteCarloOptions& options,
           const est::MonteCarloResult& result) {
  for (const est::RunDesign& run : options.runs)
    fmt::print("run at {:g} Hz, amplitude {:g}: {} points a period, {:g} cycle{}\n",
               run.frequency_hz, run.amplitude, run.points, run.cycles,
               run.cycles == 1.0 ? "" : "s");
  fmt::print("noise {:.4g} {}, {}\n\n", options.noise, model.length_unit(),
             options.kind == est::NoiseKind::normal ? "normal" : "uniform");
  std::vector<std::vector<std::string>> rows = {{"parameter", "truth", "bias/bound",
                                                 "scatter/bound", "2nd/bound", "stated/bound",
                                                 "coverage"}};
  if (options.profile) rows[0].push_back("of profiles");
  rows[0].push_back("grid/bound");
  for (const est::ParameterScore& p : result.parameters) {
    std::vector<std::string> row = {model.parameters()[static_cast<std::size_t>(p.parameter)].name,
                                    fmt::format("{:.6g}", p.truth),
                                    fmt::format("{:+.3f}", p.bias / p.bound),
                                    fmt::format("{:.3f}", p.scatter / p.bound),
                                    fmt::format("{:.3f}", p.second_bound / p.bound),
                                    fmt::format("{:.3f}", p.stated / p.bound),
                                    fmt::format("{:.2f} %", 100.0 * p.coverage)};
    if (options.profile) row.push_back(fmt::format("{:.2f} %", 100.0 * p.profile_coverage));
    row.push_back(fmt::format("{:.0e}", p.discretisation));
    rows.push_back(std::move(row));
  }
  fmt::print("{}\n",
             report::text_table(rows, {false, true, true, true, true, true, true, true, true}));
  fmt::print(
      "{} of {} replications converged; {} ended on a bound.\n"
      "bound: the Cramer-Rao bound, the smallest standard deviation without bias; 2nd: what is "
      "left\n"
      "of that when the model's bend counts (Bhattacharyya). stated: the standard errors given.\n"
      "coverage: how often the {:g} % intervals held the truth. grid: the error on data without\n"
      "noise, which is discretisation alone.\n",
      result.converged, result.replications, result.on_bound,
      100.0 * options.estimation.confidence);
  if (std::isfinite(result.on_bound_profile_coverage))
    fmt::print("Of the profile intervals of those on a bound {:.1f} % held the truth.\n",
               100.0 * result.on_bound_profile_coverage);
  if (options.bias != est::Bias::off)
    fmt::print(
        "The bias was taken off {} of them, and left in {}: too large, unknown, or across a "
        "bound.\n",
        result.bias_taken_off, result.bias_left_in);
}

}  // namespace

int monte_carlo(const Common& common, const MonteCarloCommand& command) {
  auto chosen = command.figure != 0 ? figure_case(command.figure) : own_case(command);
  if (!chosen) return fail(common, kBadInput, chosen.error().what);
  est::MonteCarloOptions& options = chosen->options;
  options.replications = command.replications;
  options.threads = command.threads;
  options.seed = command.seed;
  options.profile = command.profile;
  options.bias = *est::bias_from_name(command.bias);
  try {
    const est::Model model(chosen->model);
    if (options.truth.empty()) options.truth = model.start();
    const std::string description = described(model, options);
    const Shard part = shard_from(command.shard);
    auto all = command.merge.empty() ? est::replications(model, options, part)
                                     : merge(options.replications, description, command.merge);
    if (all && !command.keep.empty()) keep(*all, part, description, command.keep);
    if (all && part.count > 1) return kOk;
    const auto result = all ? est::score(model, options, *all) : all.error();
    if (!result) {
      const bool usage = result.error().kind == ErrorKind::invalid;
      return fail(common, usage ? kBadInput : kNegative, result.error().what);
    }
    if (common.json)
      fmt::print("{}\n", to_json(model, options, *result).dump());
    else
      print(model, options, *result);
    return kOk;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  } catch (const std::runtime_error& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
