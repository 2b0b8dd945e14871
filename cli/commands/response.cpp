// Computes the response curve of a model over frequency or amplitude, through folds, and prints
// it as a table, as JSON or as a picture.
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "config/model.hpp"
#include "estimator/solve/periodic/continuation.hpp"
#include "report/plot/plot.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
using estimator::Along;
using estimator::Branch;
using estimator::BranchPoint;
using estimator::SpecialPoint;

double value_of(const Branch& branch, const BranchPoint& point) {
  return branch.along == Along::frequency ? point.frequency_hz : point.amplitude;
}

// Half of the peak-to-peak stroke.
double motion(const BranchPoint& point) {
  return 0.5 * (point.most - point.least);
}

double phase_degrees(const BranchPoint& point) {
  return std::arg(point.harmonics.at(1)) * 180.0 / 3.14159265358979324;
}

OrderedJson to_json(const BranchPoint& point) {
  OrderedJson multipliers = OrderedJson::array();
  for (const auto& m : point.floquet.multipliers)
    multipliers.push_back({m.real(), m.imag()});
  OrderedJson harmonics = OrderedJson::array();
  for (const auto& h : point.harmonics)
    harmonics.push_back(std::abs(h));
  return {{"frequency_hz", point.frequency_hz},
          {"amplitude", point.amplitude},
          {"least", point.least},
          {"most", point.most},
          {"harmonics", std::move(harmonics)},
          {"phase_deg", phase_degrees(point)},
          {"stable", point.stable},
          {"multipliers", std::move(multipliers)}};
}

OrderedJson to_json(const Branch& branch, const std::string& model) {
  OrderedJson points = OrderedJson::array(), special = OrderedJson::array();
  for (const BranchPoint& point : branch.points)
    points.push_back(to_json(point));
  for (const SpecialPoint& each : branch.special) {
    OrderedJson entry = to_json(each.point);
    entry["kind"] = estimator::name(each.kind);
    special.push_back(std::move(entry));
  }
  return {{"model", model},
          {"complete", branch.complete},
          {"ended", branch.ended},
          {"points", std::move(points)},
          {"special", std::move(special)}};
}

std::string table(const Branch& branch, const std::string& unit) {
  std::vector<std::vector<std::string>> rows = {
      {"frequency/Hz", fmt::format("amplitude/({}/s^2)", unit), fmt::format("motion/{}", unit),
       fmt::format("first/{}", unit), "phase/deg", "multiplier", "", ""}};
  const auto add = [&](const BranchPoint& point, std::string_view what) {
    rows.push_back({fmt::format("{:.6g}", point.frequency_hz),
                    fmt::format("{:.6g}", point.amplitude), fmt::format("{:.5g}", motion(point)),
                    fmt::format("{:.5g}", std::abs(point.harmonics.at(1))),
                    fmt::format("{:.1f}", phase_degrees(point)),
                    fmt::format("{:.3f}", point.floquet.largest()),
                    point.stable ? "stable" : "unstable", std::string(what)});
  };
  std::size_t next = 0;
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    add(branch.points[i], "");
    for (; next < branch.special.size() && branch.special[next].after == i; ++next)
      add(branch.special[next].point, estimator::name(branch.special[next].kind));
  }
  return report::text_table(rows, {true, true, true, true, true, true, false, false});
}

// Stable parts are solid lines and unstable parts dashed lines; both reach to the bifurcation
// between them.
std::string picture(const Branch& branch, const std::string& model, const std::string& unit) {
  report::Plot plot;
  const bool over_frequency = branch.along == Along::frequency;
  plot.title = over_frequency ? fmt::format("{}: response at {:g} {}/s²", model, branch.held, unit)
                              : fmt::format("{}: response at {:g} Hz", model, branch.held);
  plot.x.label = over_frequency ? "frequency, Hz" : fmt::format("amplitude, {}/s²", unit);
  plot.y.label = fmt::format("half the motion from end to end, {}", unit);
  report::Curve stable{"stable", {}, {}, report::Ink::first, report::Stroke::line};
  report::Curve unstable{"unstable", {}, {}, report::Ink::second, report::Stroke::dashed};
  const double gap = std::numeric_limits<double>::quiet_NaN();
  const auto put = [&](report::Curve& curve, double x, double y) {
    curve.x.push_back(x);
    curve.y.push_back(y);
  };
  std::size_t next = 0;
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    const BranchPoint& point = branch.points[i];
    put(point.stable ? stable : unstable, value_of(branch, point), motion(point));
    for (; next < branch.special.size() && branch.special[next].after == i; ++next) {
      const BranchPoint& special = branch.special[next].point;
      put(stable, value_of(branch, special), motion(special));
      put(unstable, value_of(branch, special), motion(special));
      plot.marks.push_back({fmt::format("{} {:.4g}", estimator::name(branch.special[next].kind),
                                        value_of(branch, special)),
                            value_of(branch, special), true});
    }
    if (i + 1 < branch.points.size() && branch.points[i + 1].stable != point.stable)
      put(point.stable ? stable : unstable, gap, gap);
  }
  plot.curves.push_back(std::move(stable));
  if (!unstable.x.empty()) plot.curves.push_back(std::move(unstable));
  return report::svg_file(report::to_svg(plot));
}

}  // namespace

int response(const Common& common, const ResponseOptions& options) {
  const bool over_frequency = options.amplitude && options.from && options.to;
  const bool over_amplitude = options.frequency_hz && options.amplitudes.size() == 2;
  if (over_frequency == over_amplitude)
    return fail(common, kBadInput,
                "give --amplitude A --from F1 --to F2 for a curve over the frequency, or --at F "
                "--amplitudes A1,A2 for one over the amplitude");
  const double from = over_frequency ? *options.from : options.amplitudes[0];
  const double to = over_frequency ? *options.to : options.amplitudes[1];
  if (from == to)
    return fail(common, kBadInput, fmt::format("the curve would run from {:g} to {:g}", from, to));
  auto spec = config::load_model(options.model);
  if (!spec) return fail(common, kBadInput, spec.error().what);
  try {
    const estimator::Model model(*spec);
    estimator::Continuation continuation(model, model.start());
    const Branch branch = over_frequency
                              ? continuation.over_frequency(*options.amplitude, from, to)
                              : continuation.over_amplitude(*options.frequency_hz, from, to);
    if (branch.points.empty()) return fail(common, kNotUsable, branch.ended);
    if (!options.svg.empty()) {
      std::ofstream file(options.svg);
      file << picture(branch, model.name(), model.length_unit());
      if (!file.flush())
        return fail(common, kBadInput, fmt::format("{} cannot be written", options.svg.string()));
    }
    if (common.json) {
      fmt::print("{}\n", to_json(branch, model.name()).dump());
    } else {
      fmt::print("{}\n{}.\n", table(branch, model.length_unit()), branch.ended);
    }
    return branch.complete ? kOk : kNegative;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, fmt::format("{}: {}", options.model.string(), error.what()));
  }
}

}  // namespace shaker::cli
