#include "tests/blind/records.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "sim/plant.hpp"

namespace shaker::blind {
namespace {

namespace diagnosis = estimator::diagnosis;

constexpr int kSteps = 8;  // of the integration between two samples
constexpr double kRecordQuantum = 1e-6;
constexpr std::string_view kShapes[] = {"random", "swept", "drop"};
constexpr std::string_view kNoises[] = {"white", "coloured", "excitation", "coloured_excitation",
                                        "both"};

using Course = std::function<double(double)>;  // the table's acceleration over time

sim::State moved(const sim::State& from, const sim::State& rate, double step) {
  sim::State to = from;
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] += step * rate[i];
  return to;
}

sim::State stepped(const sim::Plant& plant, const sim::State& s, double t, double dt,
                   const Course& table) {
  const auto rate = [&](const sim::State& at, double time) {
    return plant.rate(at, at[1] < 0.0 ? -1.0 : 1.0, table(time));
  };
  const auto k1 = rate(s, t), k2 = rate(moved(s, k1, 0.5 * dt), t + 0.5 * dt);
  const auto k3 = rate(moved(s, k2, 0.5 * dt), t + 0.5 * dt), k4 = rate(moved(s, k3, dt), t + dt);
  sim::State to = s;
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
  return to;
}

// Sines without a common period, which start during the first half second.
Course random_course(std::mt19937_64& source, double level) {
  struct Sine {
    double amplitude, omega, phase;
  };
  std::uniform_real_distribution<double> uniform(0.0, 2.0 * std::numbers::pi);
  std::vector<Sine> sines;
  constexpr int kCount = 48;
  for (int i = 0; i < kCount; ++i) {
    const double hz = 0.3 + 5.7 * (i + uniform(source) / 6.3) / kCount;
    sines.push_back(
        {level * std::sqrt(2.0 / kCount), 2.0 * std::numbers::pi * hz, uniform(source)});
  }
  return [sines](double t) {
    double x = 0.0;
    for (const Sine& s : sines)
      x += s.amplitude * std::sin(s.omega * t + s.phase);
    return x * std::min(1.0, 2.0 * t);
  };
}

Course swept_course(double from_hz, double to_hz, double level, double duration) {
  return [=](double t) {
    const double cycles = from_hz * t + 0.5 * (to_hz - from_hz) * t * t / duration;
    return level * std::min(1.0, t) * std::sin(2.0 * std::numbers::pi * cycles);
  };
}

// Autoregressive noise of unit standard deviation.
class Noise {
 public:
  Noise(double rho, std::uint64_t seed) : rho_(rho), source_(seed), last_(normal_(source_)) {}
  double operator()() {
    last_ = rho_ * last_ + std::sqrt(1.0 - rho_ * rho_) * normal_(source_);
    return last_;
  }

 private:
  double rho_;
  std::mt19937_64 source_;
  std::normal_distribution<double> normal_;
  double last_;
};

struct Level {
  double rho = 0.0, deviation = 0.0;
};

struct Levels {
  Level sensor, excitation;
};

Levels levels_of(const RecordCase& wanted, std::mt19937_64& source) {
  std::uniform_real_distribution<double> uniform;
  const auto between = [&](double low, double high) {
    return low * std::pow(high / low, uniform(source));
  };
  const double rho = 0.5 + 0.45 * uniform(source);
  const double deviation = between(1e-5, 1e-4), of_excitation = between(3e-3, 3e-2);
  Levels levels{{0.0, 2e-5}, {0.0, 0.0}};
  const auto is = [&](RecordNoise noise) { return wanted.noise == noise; };
  if (is(RecordNoise::coloured) || is(RecordNoise::both)) levels.sensor = {rho, deviation};
  if (is(RecordNoise::excitation) || is(RecordNoise::both))
    levels.excitation = {0.0, of_excitation};
  if (is(RecordNoise::coloured_excitation)) levels.excitation = {rho, of_excitation};
  return levels;
}

diagnosis::Recording record(const RecordCase& wanted, const Levels& levels, int run,
                            std::mt19937_64& source) {
  const sim::Plant plant(wanted.plant, wanted.truth);
  const bool drop = wanted.shape == Shape::drop;
  const double duration = drop ? 1.5 : wanted.seconds, rate = drop ? 1000.0 : 250.0;
  sim::State state = plant.at_rest();
  Course table = [](double) { return 0.0; };
  if (drop) {
    state[0] = 0.0;
    state[1] = 1.2 + 0.5 * run;
  } else if (wanted.shape == Shape::random) {
    table = random_course(source, 1.2 + 0.5 * run);
  } else {
    table = swept_course(0.5 + 0.2 * run, 4.0 - 0.5 * run, 2.0 + 0.5 * run, duration);
  }
  Noise sensor(levels.sensor.rho, source()), measuring(levels.excitation.rho, source());
  diagnosis::Recording r;
  r.name = fmt::format("r{:02}", run + 1);
  r.kind = diagnosis::Kind::transient;
  r.role = run == 2 ? diagnosis::Role::held_out : diagnosis::Role::fit;
  r.role_given = true;
  for (int i = 0; i < static_cast<int>(duration * rate); ++i) {
    const double t = i / rate, dt = 1.0 / rate / kSteps;
    r.t.push_back(t);
    r.displacement.push_back(
        std::round((state[0] + levels.sensor.deviation * sensor()) / kRecordQuantum) *
        kRecordQuantum);
    if (!drop) r.excitation.push_back(table(t) + levels.excitation.deviation * measuring());
    for (int k = 0; k < kSteps; ++k)
      state = stepped(plant, state, t + k * dt, dt, table);
  }
  return r;
}

bool possible(Shape shape, RecordNoise noise) {
  return shape != Shape::drop || noise == RecordNoise::white || noise == RecordNoise::coloured;
}

std::vector<RecordCase> cases_of(int count, const std::vector<std::pair<std::string, Truth>>& all) {
  std::vector<RecordCase> cases;
  for (std::uint64_t seed = 1; static_cast<int>(cases.size()) < count;) {
    for (const auto noise : {RecordNoise::white, RecordNoise::coloured, RecordNoise::excitation,
                             RecordNoise::coloured_excitation, RecordNoise::both}) {
      for (const Shape shape : {Shape::random, Shape::swept, Shape::drop}) {
        for (const char* plant : {"oleo", "linear"}) {
          if (!possible(shape, noise) || static_cast<int>(cases.size()) == count) continue;
          const auto& [hidden, truth] = all[seed % all.size()];
          cases.push_back({shape, plant, noise, hidden, truth, seed++});
        }
      }
    }
  }
  return cases;
}

}  // namespace

std::string RecordCase::label() const {
  return fmt::format("{}, {}, {}, {}, seed {}", hidden.empty() ? "nothing" : hidden,
                     kShapes[static_cast<int>(shape)], plant, kNoises[static_cast<int>(noise)],
                     seed);
}

std::vector<RecordCase> record_nulls(int count) {
  return cases_of(count, {{"", {}}});
}

std::vector<RecordCase> record_effects(int count) {
  return cases_of(count, {{"cubic_stiffness", {{"cubic_stiffness", 4000.0}}},
                          {"added_mass", {{"added_mass", 0.04}}},
                          {"presliding_friction",
                           {{"presliding_friction", 0.2}, {"presliding_distance", 2e-3}}}});
}

diagnosis::Campaign record_campaign(const RecordCase& wanted) {
  std::mt19937_64 source(7919 * wanted.seed + 13);
  const Levels levels = levels_of(wanted, source);
  diagnosis::Campaign campaign;
  campaign.name = wanted.label();
  for (int run = 0; run < 3; ++run)
    campaign.runs.push_back(record(wanted, levels, run, source));
  return campaign;
}

Answer answer(const RecordCase& wanted) {
  return asked(record_campaign(wanted),
               wanted.plant == "oleo" ? "model-oleo.json" : "model-linear-oscillator.json");
}

std::string report(const std::vector<ScoredRecord>& scored) {
  std::string text =
      "| records, noise | campaigns | alarmed | refused | named first | in the set |\n"
      "|---|---|---|---|---|---|\n";
  const auto row = [&](const std::string& name, const auto& wanted) {
    int of = 0, alarmed = 0, refused = 0, first = 0, in_set = 0;
    for (const ScoredRecord& s : scored) {
      if (!wanted(s.hidden)) continue;
      ++of;
      refused += s.answer.verdict == "refused" ? 1 : 0;
      alarmed += s.answer.verdict == "explained" || s.answer.verdict == "unexplained" ? 1 : 0;
      if (s.answer.effects.empty()) continue;
      const auto& effects = s.answer.effects;
      first += effects.front().name == s.hidden.hidden ? 1 : 0;
      in_set += std::ranges::any_of(effects, [&](const Named& n) {
        return n.name == s.hidden.hidden ||
               std::ranges::find(n.confusable_with, s.hidden.hidden) != n.confusable_with.end();
      });
    }
    if (of > 0)
      text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", name, of, alarmed, refused, first,
                          in_set);
  };
  for (std::size_t n = 0; n < std::size(kNoises); ++n)
    row(std::string(kNoises[n]),
        [&](const RecordCase& c) { return c.noise == static_cast<RecordNoise>(n); });
  for (std::size_t k = 0; k < std::size(kShapes); ++k)
    row(std::string(kShapes[k]),
        [&](const RecordCase& c) { return c.shape == static_cast<Shape>(k); });
  row("all", [](const RecordCase&) { return true; });
  return text;
}

}  // namespace shaker::blind
