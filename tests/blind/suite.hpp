// The blind suite: campaigns of the virtual rig in which something, or nothing, is hidden, answered
// by the discrepancy workflow and scored.
//
// Each truth is written into a file of its own before the workflow sees the records, and opened
// again only to score the answer. The records come from sim/, whose physics and integrator are its
// own.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/discrepancy/campaign.hpp"
#include "estimator/discrepancy/diagnose.hpp"
#include "sim/campaign_recorder.hpp"
#include "tests/blind/cases.hpp"

namespace shaker::blind {

struct Case {
  std::string kind;  // "nothing", a kind of effect, or "first + second"
  std::string size;  // of kSizeNames; empty for nothing and for pairs
  int design = 0, noise = 0;
  Truth truth;
  std::uint64_t seed = 1;
  std::string label() const;  // "coulomb_friction, small, wide, usual, seed 7"
};

// All kinds x sizes x noises x designs, `nulls` campaigns in which nothing is hidden, and all pairs
// x noises x designs. The order is fixed; seeds follow from what is hidden.
std::vector<Case> all_cases(int nulls);

struct Named {
  std::string name;
  double probability = 0.0;
  std::vector<std::string> confusable_with;
};

struct Answer {
  std::string verdict;  // "refused" when the workflow gave an error
  std::string trouble;  // that error
  std::vector<Named> effects;
  double gap_before = 0.0, gap_after = 0.0;  // over the noise floor
  double by_chance = 0.0;                    // probability of such a gap from noise alone
  double noise_after = 0.0;                  // gap after over the expected noise
  double seconds = 0.0;                      // of processor time
};

// Of this thread.
double processor_seconds();
// One of config/examples. Throws std::runtime_error where it cannot be read.
config::ModelSpec base_model(const std::string& example);

// The virtual rig's records of a plan, as the workflow takes them.
estimator::discrepancy::Campaign recorded(const sim::CampaignRecording& plan);

// What the workflow says of records with an example's base model ("model-oleo.json").
Answer asked(const estimator::discrepancy::Campaign& campaign, const std::string& example,
             const estimator::discrepancy::DiagnoseOptions& options = {});

// Records the campaign, seals the truth in `sealed`, and asks the workflow.
Answer answer(const Case& hidden, const std::filesystem::path& sealed,
              const estimator::discrepancy::DiagnoseOptions& options = {});

struct Scored {
  Case hidden;
  Answer answer;
  bool null = false, in_catalogue = false;
  bool detected = false;
  bool named_first = false, in_set = false;  // every hidden effect, for a pair
  bool told_apart = false;                   // the answer names no rival of its first effect
  bool wrong_and_sure = false;               // a wrong name, first or further, at more than 0.95
};

// Opens the sealed truth.
Scored score(const Case& hidden, const Answer& answer, const std::filesystem::path& sealed);

// All of `cases` on so many threads; `done` is told after each.
std::vector<Scored> run(const std::vector<Case>& cases, const std::filesystem::path& folder,
                        int threads, const std::function<void(const Scored&)>& done,
                        const estimator::discrepancy::DiagnoseOptions& options = {});

// How far probabilities by chance are from an even distribution on 0..1 (Kolmogorov's test).
struct Evenness {
  double distance = 0.0;  // largest, of the cumulative distributions
  double chance = 1.0;    // of at least that
};
Evenness evenness(std::vector<double> chances);

// Tables in Markdown: the figures that are wanted, the chances where nothing is hidden, a row a
// kind, and the confusion matrix.
std::string report(const std::vector<Scored>& scored, double false_alarm_rate);

}  // namespace shaker::blind
