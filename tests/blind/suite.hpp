// The blind suite: campaigns of the virtual rig in which an effect, or nothing, is hidden,
// diagnosed and scored.
//
// Each truth is written to a separate file before the diagnosis gets the records. The file is
// opened again only for the score. The records come from sim/, which has its own physics and
// integrator.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/diagnose.hpp"
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

// All kinds x sizes x noises x designs, `nulls` campaigns in which nothing is hidden, and all
// pairs x noises x designs. The order is fixed; a seed follows from what is hidden.
std::vector<Case> all_cases(int nulls);

struct Named {
  std::string name;
  double probability = 0.0;
  std::vector<std::string> confusable_with;
};

struct Answer {
  std::string verdict;  // "refused" when the diagnosis returned an Error
  std::string trouble;  // the text of that Error
  std::vector<Named> effects;
  double gap_before = 0.0, gap_after = 0.0;  // over the noise floor
  double by_chance = 0.0;                    // probability of such a gap from noise alone
  double noise_after = 0.0;                  // gap after over the expected noise
  double seconds = 0.0;                      // of processor time
};

// Processor time of this thread, s.
double processor_seconds();
// The model of a file in config/examples. Throws std::runtime_error when it cannot be read.
config::ModelSpec base_model(const std::string& example);

// The records of the virtual rig, in the form that the diagnosis takes. A run at which the rig trips
// has a lower amplitude than planned.
estimator::diagnosis::Campaign recorded(sim::CampaignRecording plan);

// Diagnoses records with the base model of an example ("model-oleo.json").
Answer asked(const estimator::diagnosis::Campaign& campaign, const std::string& example,
             const estimator::diagnosis::DiagnoseOptions& options = {});

// Records the campaign, writes the truth to `sealed`, and diagnoses it.
Answer answer(const Case& hidden, const std::filesystem::path& sealed,
              const estimator::diagnosis::DiagnoseOptions& options = {});

struct Scored {
  Case hidden;
  Answer answer;
  bool null = false, in_catalogue = false;
  bool detected = false;
  bool named_first = false, in_set = false;  // every hidden effect, for a pair
  bool told_apart = false;                   // first effect: its indistinguishable set is empty
  bool wrong_and_sure = false;               // a wrong effect with a probability above 0.95
};

// Reads the truth from `sealed`.
Scored score(const Case& hidden, const Answer& answer, const std::filesystem::path& sealed);

// Runs all cases on `threads` threads; `done` is called after each case.
std::vector<Scored> run(const std::vector<Case>& cases, const std::filesystem::path& folder,
                        int threads, const std::function<void(const Scored&)>& done,
                        const estimator::diagnosis::DiagnoseOptions& options = {});

// The distance of probabilities by chance from the uniform distribution on 0..1 (Kolmogorov's
// test).
struct Evenness {
  double distance = 0.0;  // largest difference of the cumulative distributions
  double chance = 1.0;    // probability of at least that distance
};
Evenness evenness(std::vector<double> chances);

// Tables in Markdown: the required figures, the probabilities by chance when nothing is hidden,
// one row for each kind, and the confusion matrix.
std::string report(const std::vector<Scored>& scored, double false_alarm_rate);

}  // namespace shaker::blind
