#include "tests/blind/suite.hpp"

#include <algorithm>
#include <atomic>
#include <ctime>
#include <fstream>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "config/model.hpp"

namespace shaker::blind {
namespace {

namespace diagnosis = estimator::diagnosis;
namespace fs = std::filesystem;

void seal(const Case& hidden, const fs::path& file) {
  std::ofstream out(file);
  out << nlohmann::json{{"kind", hidden.kind}, {"truth", hidden.truth}}.dump() << '\n';
  out.close();
  if (!out) throw std::runtime_error(fmt::format("{}: cannot be written", file.string()));
}

const Kind* find_kind(std::string_view name) {
  const auto found = std::ranges::find(kinds(), name, &Kind::name);
  return found == kinds().end() ? nullptr : &*found;
}

std::vector<std::string> parts_of(const std::string& kind) {
  const auto plus = kind.find(" + ");
  if (plus == std::string::npos) return {kind};
  return {kind.substr(0, plus), kind.substr(plus + 3)};
}

bool mentions(const Named& named, const std::string& name) {
  return named.name == name ||
         std::ranges::find(named.confusable_with, name) != named.confusable_with.end();
}

// A hash (FNV-1a) of what is hidden, not of its position, so that a new kind does not change
// the draws of the others.
std::uint64_t seed_of(std::string_view what) {
  std::uint32_t hash = 2166136261U;
  for (const char c : what)
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash % 1000000U;
}

}  // namespace

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

config::ModelSpec base_model(const std::string& example) {
  auto model = config::load_model(fs::path(SHAKER_SOURCE_DIR) / "config/examples" / example);
  if (!model.ok()) throw std::runtime_error(model.error().what);
  return model.value();
}

std::string Case::label() const {
  return fmt::format("{}{}{}, {}, {}, seed {}", kind, size.empty() ? "" : ", ", size,
                     designs()[static_cast<std::size_t>(design)].name,
                     noises()[static_cast<std::size_t>(noise)].name, seed);
}

std::vector<Case> all_cases(int nulls) {
  std::vector<Case> cases;
  const auto add = [&](std::string kind, std::string size, int design, int noise, Truth truth,
                       int repetition = 0) {
    const std::uint64_t seed =
        seed_of(fmt::format("{} {} {} {} {}", kind, size, design, noise, repetition));
    cases.push_back(Case{std::move(kind), std::move(size), design, noise, std::move(truth), seed});
  };
  const int n_designs = static_cast<int>(designs().size());
  const int n_noises = static_cast<int>(noises().size());
  for (int design = 0; design < n_designs; ++design) {
    for (int noise = 0; noise < n_noises; ++noise) {
      for (const Kind& kind : kinds()) {
        for (std::size_t size = 0; size < 3; ++size) {
          add(std::string(kind.name), std::string(kSizeNames[size]), design, noise,
              kind.sizes[size]);
        }
      }
      for (const Pair& pair : pairs())
        add(fmt::format("{} + {}", pair.first, pair.second), "", design, noise, pair.truth);
    }
  }
  for (int i = 0; i < nulls; ++i)
    add("nothing", "", i % n_designs, (i / n_designs) % n_noises, {}, i);
  return cases;
}

namespace {

// The record of a run. Where the rig trips (the damper bottomed), the run is recorded again with a
// lower amplitude, as the operator is told to do.
sim::Record record_below_the_trip(sim::CampaignRecording& plan, std::size_t run) {
  constexpr double kLower = 0.8;  // of the amplitude
  constexpr int kMostTries = 4;
  for (int tries = 1;; ++tries) {
    try {
      return sim::record_run(plan, run);
    } catch (const std::runtime_error&) {
      if (tries == kMostTries) throw;
      plan.runs[run].amplitude *= kLower;
    }
  }
}

}  // namespace

diagnosis::Campaign recorded(sim::CampaignRecording plan) {
  diagnosis::Campaign campaign;
  campaign.name = "blind";
  for (std::size_t r = 0; r < plan.runs.size(); ++r) {
    auto record = record_below_the_trip(plan, r);
    diagnosis::Recording run;
    run.name = plan.runs[r].name;
    run.role = plan.runs[r].held_out ? diagnosis::Role::held_out : diagnosis::Role::fit;
    run.role_given = true;
    run.frequency_hz = plan.runs[r].frequency_hz;
    run.amplitude = plan.runs[r].amplitude;
    run.t = std::move(record.t);
    run.excitation = std::move(record.excitation);
    run.displacement = std::move(record.displacement);
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

Answer answer(const Case& hidden, const fs::path& sealed,
              const diagnosis::DiagnoseOptions& options) {
  seal(hidden, sealed);
  const auto plan =
      recording(designs()[static_cast<std::size_t>(hidden.design)],
                noises()[static_cast<std::size_t>(hidden.noise)], hidden.truth, hidden.seed);
  return asked(recorded(plan), "model-oleo.json", options);
}

Answer asked(const diagnosis::Campaign& campaign, const std::string& example,
             const diagnosis::DiagnoseOptions& options) {
  const config::ModelSpec model = base_model(example);
  Answer given;
  const double before = processor_seconds();
  const auto diagnosed = diagnosis::diagnose(campaign, model, options);
  given.seconds = processor_seconds() - before;
  if (!diagnosed.ok()) {
    given.verdict = "refused";
    given.trouble = diagnosed.error().what;
    return given;
  }
  const auto& found = diagnosed.value();
  given.verdict = diagnosis::name(found.verdict);
  for (const auto& effect : found.effects)
    given.effects.push_back({effect.name, effect.probability, effect.confusable_with});
  given.by_chance = found.probability_before;
  given.gap_before = found.gap.before / found.gap.noise_floor;
  given.gap_after = found.gap.after / found.gap.noise_floor;
  given.noise_after = found.gap.after / found.gap.noise;
  return given;
}

Scored score(const Case& hidden, const Answer& given, const fs::path& sealed) {
  std::ifstream in(sealed);
  const auto truth = nlohmann::json::parse(in);
  const std::string kind = truth.at("kind");
  Scored scored{hidden, given};
  scored.null = kind == "nothing";
  const auto parts = parts_of(kind);
  scored.in_catalogue = !scored.null && std::ranges::all_of(parts, [](const std::string& part) {
    const Kind* known = find_kind(part);
    return known != nullptr && known->in_catalogue;
  });
  scored.detected = given.verdict == "explained" || given.verdict == "unexplained";
  if (given.effects.empty()) return scored;
  const Named& first = given.effects.front();
  scored.told_apart = first.confusable_with.empty();
  const auto named = [&](const std::string& part) {
    return std::ranges::any_of(given.effects, [&](const Named& n) { return n.name == part; });
  };
  const auto listed = [&](const std::string& part) {
    return std::ranges::any_of(given.effects, [&](const Named& n) { return mentions(n, part); });
  };
  scored.in_set = std::ranges::all_of(parts, listed);
  scored.named_first =
      parts.size() == 1 ? first.name == parts.front() : std::ranges::all_of(parts, named);
  scored.wrong_and_sure = std::ranges::any_of(given.effects, [&](const Named& n) {
    return n.probability > 0.95 && std::ranges::find(parts, n.name) == parts.end();
  });
  return scored;
}

std::vector<Scored> run(const std::vector<Case>& cases, const fs::path& folder, int threads,
                        const std::function<void(const Scored&)>& done,
                        const diagnosis::DiagnoseOptions& options) {
  fs::create_directories(folder);
  std::vector<Scored> all(cases.size());
  std::atomic<std::size_t> next{0};
  std::mutex telling;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      const auto sealed = folder / fmt::format("{:05}.json", i);
      Answer given;
      try {
        given = answer(cases[i], sealed, options);
      } catch (const std::exception& error) {
        given.verdict = "refused";
        given.trouble = error.what();
      }
      all[i] = score(cases[i], given, sealed);
      const std::scoped_lock lock(telling);
      done(all[i]);
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int k = 0; k < threads; ++k)
      workers.emplace_back(work);
  }
  return all;
}

}  // namespace shaker::blind
