// Measures how often the interval of a predicted drop holds the true drop, over the campaigns of
// the blind suite (tests/blind/suite.hpp).
//
//   build/bench/drop_coverage --every 7 --threads 2
//   build/bench/drop_coverage --kind metering_pin --keep rows.jsonl
//   build/bench/drop_coverage --every 16 --join 2    # a measured drop at 2 m/s joins each estimate
//
// Each campaign of the virtual rig is diagnosed, and its drops at three sink speeds are predicted.
// The truth is the fall of the hidden plant (drop_truth.hpp), which the prediction never sees. The
// table says for each kind how often the 95 % intervals of peak load, peak stroke and efficiency
// hold the truth, the same of the linear band of the parameters, and the median of the interval's
// width over that of the linear band of the true model.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/heap.hpp"
#include "bench/drop_truth.hpp"
#include "estimator/drop/drop_mixture.hpp"
#include "estimator/drop/internal/drop_surrogate.hpp"
#include "estimator/drop/joined_drop.hpp"
#include "report/damper_document.hpp"
#include "tests/blind/suite.hpp"

namespace {

using namespace shaker;
using estimator::IdentifiedDamper;

constexpr const char* kFigures[] = {"peak_load", "peak_stroke", "efficiency"};
constexpr double kSpeeds[] = {1.0, 2.0, 3.0};
constexpr std::uint64_t kSeedsApart = 1'000'003;  // beyond the suite's own seeds

struct Row {
  std::string label, kind, verdict, figure;
  double speed = 0.0, truth = 0.0;
  estimator::MixtureBand band;
  double known_width = std::numeric_limits<double>::quiet_NaN();  // of the true model's band
  double seconds = 0.0;                                           // of the prediction
  std::string trouble;                                            // why there is no prediction

  bool held() const { return trouble.empty() && band.lower <= truth && truth <= band.upper; }
  bool held_linear() const {
    return trouble.empty() && band.linear_lower <= truth && truth <= band.linear_upper;
  }
};

// The effects that are hidden, as a hypothesis names them.
std::vector<std::string> hidden_effects(const blind::Case& hidden) {
  if (hidden.kind == "nothing") return {};
  std::vector<std::string> effects = {hidden.kind};
  if (const auto plus = hidden.kind.find(" + "); plus != std::string::npos)
    effects = {hidden.kind.substr(0, plus), hidden.kind.substr(plus + 3)};
  // Drift and quantisation are read from the records and are no part of a hypothesis.
  std::erase_if(effects, [](const std::string& e) {
    return e == "sensor_drift" || e == "sensor_quantisation";
  });
  std::sort(effects.begin(), effects.end());
  return effects;
}

IdentifiedDamper diagnosed(const blind::Case& hidden, const std::string& folder) {
  const std::filesystem::path file =
      std::filesystem::path(folder) /
      (std::to_string(std::hash<std::string>()(hidden.label())) + ".json");
  if (!folder.empty() && std::filesystem::exists(file)) {
    auto damper = report::read_damper(file);
    if (!damper) throw std::runtime_error(damper.error().what);
    return std::move(*damper);
  }
  const auto plan = blind::recording(blind::designs()[static_cast<std::size_t>(hidden.design)],
                                     blind::noises()[static_cast<std::size_t>(hidden.noise)],
                                     hidden.truth, hidden.seed);
  auto found =
      estimator::diagnosis::diagnose(blind::recorded(plan), blind::base_model("model-oleo.json"));
  if (!found) throw std::runtime_error(found.error().what);
  if (!folder.empty()) std::ofstream(file) << report::damper_json(found->damper);
  return std::move(found->damper);
}

// The linear band's half width of the hypothesis that is the truth; nothing where it is not among
// those that were kept.
std::optional<estimator::DropSurrogate> known(const IdentifiedDamper& damper,
                                              const blind::Case& hidden, double speed) {
  for (const auto& h : damper.hypotheses) {
    if (h.effects != hidden_effects(hidden)) continue;
    auto drop =
        estimator::DropSurrogate::make(estimator::without_instruments(h), {speed, 0.0, 1.5, -1});
    if (drop) return std::move(*drop);
  }
  return std::nullopt;
}

struct Settings {
  std::string folder;             // of diagnoses that are kept; empty: none
  estimator::MixtureOptions how;  // of the predictions
  // Sink speed of a drop that joins each estimate, and the noise of its stroke; 0: none does.
  double joined_speed = 0.0, joined_noise = 1e-4;
};

// The estimate with the fall of the hidden plant, and what that says of it in place of the verdict.
// As it was where the plant has no such drop.
void join(const blind::Case& hidden, const Settings& settings, IdentifiedDamper& damper) {
  constexpr std::size_t kEvery = 12;  // times of the truth
  const auto truth = bench::true_drop(hidden.truth, settings.joined_speed);
  if (truth.bottomed) return;
  std::mt19937_64 random(hidden.seed);
  std::normal_distribution<double> noise(0.0, settings.joined_noise);
  estimator::DropRecord record;
  for (std::size_t i = 0; i < truth.t.size(); i += kEvery) {
    record.t.push_back(truth.t[i]);
    record.stroke.push_back(truth.stroke[i] + noise(random));
  }
  auto joined = estimator::join_drop(damper, {settings.joined_speed, 0.0, 1.5, -1}, record);
  if (!joined) throw std::runtime_error(joined.error().what);
  damper = std::move(joined->damper);
  damper.verdict = joined->intervals_hold ? "the drop agrees" : "the drop disagrees";
}

std::vector<Row> rows_of(const blind::Case& hidden, const Settings& settings) {
  std::vector<Row> rows;
  std::optional<IdentifiedDamper> damper;
  std::string refused;
  try {
    damper = diagnosed(hidden, settings.folder);
    if (settings.joined_speed > 0.0) join(hidden, settings, *damper);
  } catch (const std::exception& error) {
    refused = error.what();
  }
  for (const double speed : kSpeeds) {
    const auto truth = bench::true_drop(hidden.truth, speed);
    if (truth.bottomed) continue;
    std::optional<estimator::DropMixture> drop;
    std::string trouble = refused;
    const double before = blind::processor_seconds();
    if (damper) {
      auto made = estimator::predict_drop(*damper, {speed, 0.0, 1.5, -1}, settings.how);
      if (made)
        drop = std::move(*made);
      else
        trouble = made.error().what;
    }
    const double seconds = blind::processor_seconds() - before;
    const auto reference =
        damper ? known(*damper, hidden, speed) : std::optional<estimator::DropSurrogate>();
    const double truths[] = {truth.peak_load, truth.peak_stroke, truth.efficiency};
    for (std::size_t k = 0; k < std::size(kFigures); ++k) {
      const std::size_t f = estimator::figure_called(kFigures[k]);
      Row row;
      row.label = hidden.label();
      row.kind = hidden.kind;
      row.verdict = damper ? damper->verdict : "refused";
      row.figure = kFigures[k];
      row.speed = speed;
      row.truth = truths[k];
      if (drop) row.band = drop->bands[f];
      if (reference)
        row.known_width = 2.0 * reference->quantile(0.975) * reference->linear_error(f);
      row.seconds = seconds;
      row.trouble = trouble;
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::string line_of(const Row& r) {
  return nlohmann::ordered_json{{"label", r.label},
                                {"kind", r.kind},
                                {"verdict", r.verdict},
                                {"figure", r.figure},
                                {"speed", r.speed},
                                {"truth", r.truth},
                                {"value", r.band.value},
                                {"lower", r.band.lower},
                                {"upper", r.band.upper},
                                {"linear_lower", r.band.linear_lower},
                                {"linear_upper", r.band.linear_upper},
                                {"known_width", r.known_width},
                                {"seconds", r.seconds},
                                {"trouble", r.trouble}}
      .dump();
}

struct Count {
  int of = 0, held = 0, linear = 0;
  std::map<std::string, std::pair<int, int>> figures;  // held, of
  std::vector<double> ratios;

  void add(const Row& r) {
    ++of;
    held += r.held() ? 1 : 0;
    linear += r.held_linear() ? 1 : 0;
    figures[r.figure].first += r.held() ? 1 : 0;
    ++figures[r.figure].second;
    const double ratio = (r.band.upper - r.band.lower) / r.known_width;
    if (r.trouble.empty() && std::isfinite(ratio)) ratios.push_back(ratio);
  }
};

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

std::string table_line(const std::string& name, const Count& c) {
  const auto share = [](int held, int of) { return of > 0 ? 100.0 * held / of : 0.0; };
  std::string text = fmt::format("| {} | {} | {:.1f} ", name, c.of, share(c.held, c.of));
  for (const char* figure : kFigures) {
    const auto found = c.figures.find(figure);
    text += found == c.figures.end()
                ? "| - "
                : fmt::format("| {:.1f} ", share(found->second.first, found->second.second));
  }
  const double ratio = median_of(c.ratios);
  return text + fmt::format("| {:.1f} | {} |\n", share(c.linear, c.of),
                            std::isfinite(ratio) ? fmt::format("{:.2f}", ratio) : "-");
}

std::string table(const std::vector<Row>& rows) {
  std::map<std::string, Count> by_kind, by_verdict, by_speed;
  Count all;
  double seconds = 0.0, slowest = 0.0;
  for (const Row& r : rows) {
    by_kind[r.kind].add(r);
    by_verdict[r.verdict].add(r);
    by_speed[fmt::format("{:g} m/s", r.speed)].add(r);
    all.add(r);
    seconds += r.seconds / static_cast<double>(rows.size());
    slowest = std::max(slowest, r.seconds);
  }
  std::string text =
      "| hidden | intervals | hold, % | load | stroke | efficiency | linear band | width |\n"
      "|---|---|---|---|---|---|---|---|\n" +
      table_line("all", all);
  for (const auto* groups : {&by_verdict, &by_speed, &by_kind}) {
    for (const auto& [name, count] : *groups)
      text += table_line(name, count);
  }
  return text + fmt::format("\nA prediction takes {:.2f} s at the mean, {:.2f} s at most.\n",
                            seconds, slowest);
}

// With another draw of all that is random in the campaigns; 0: the suite's own.
std::vector<blind::Case> chosen(int nulls, int every, const std::string& kind,
                                const std::string& label, unsigned draw) {
  std::vector<blind::Case> some;
  int at = 0;
  for (blind::Case& one : blind::all_cases(nulls)) {
    if (!kind.empty() && one.kind != kind) continue;
    if (one.label().find(label) == std::string::npos) continue;
    if (at++ % every != 0) continue;
    one.seed += draw * kSeedsApart;
    some.push_back(std::move(one));
  }
  return some;
}

std::vector<Row> measured(const std::vector<blind::Case>& cases, int threads,
                          const Settings& settings, std::ofstream* kept) {
  std::vector<Row> all;
  std::atomic<std::size_t> next{0};
  std::mutex adding;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      const auto rows = rows_of(cases[i], settings);
      const std::scoped_lock lock(adding);
      for (const Row& row : rows) {
        if (kept != nullptr) *kept << line_of(row) << '\n';
        all.push_back(row);
      }
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int k = 0; k < threads; ++k)
      workers.emplace_back(work);
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Counts how often the interval of a predicted drop holds the true one.",
               "drop_coverage");
  keep_freed_memory();  // the same as in shakerctl
  int nulls = 27, threads = 1, every = 1;
  unsigned draw = 0;
  std::string kind, label, kept;
  Settings settings;
  app.add_option("--nulls", nulls, "campaigns in which nothing is hidden")->capture_default_str();
  app.add_option("--threads", threads, "that work at once")->capture_default_str();
  app.add_option("--every", every, "only every so many-th case")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--kind", kind, "only cases of this kind");
  app.add_option("--label", label, "only cases whose label holds this");
  app.add_option("--draw", draw,
                 "another draw of the noise in all campaigns; 0: the blind suite's");
  app.add_option("--keep", kept, "write a line of JSON for each interval into this file");
  app.add_option("--diagnoses", settings.folder,
                 "keep the diagnoses in this folder, and take them from it");
  app.add_option("--cd-spread", settings.how.priors.discharge_spread, "as of shakerctl drop");
  app.add_option("--index-spread", settings.how.priors.index_spread, "as of shakerctl drop");
  app.add_option("--join", settings.joined_speed, "a measured drop at this sink speed joins, m/s");
  app.add_option("--join-noise", settings.joined_noise, "of its stroke, m")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    if (!settings.folder.empty()) std::filesystem::create_directories(settings.folder);
    std::ofstream out;
    if (!kept.empty()) out.open(kept);
    const auto rows = measured(chosen(nulls, every, kind, label, draw), threads, settings,
                               kept.empty() ? nullptr : &out);
    fmt::print("{}", table(rows));
  } catch (const std::exception& error) {
    fmt::print(stderr, "drop_coverage: {}\n", error.what());
    return 1;
  }
  return 0;
}
