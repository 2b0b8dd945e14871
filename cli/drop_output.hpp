// What both ways of `drop` share: units and scales of the figures, pictures, and a measured drop
// beside the prediction.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "cli/drop_sections.hpp"
#include "cli/measured_drop.hpp"
#include "estimator/drop/drop_mixture.hpp"

namespace shaker::cli {

// Labels, units and scales of the figures, as they are printed.
ComparisonWords figure_words(const std::string& length, const std::optional<double>& mass);

// Everything of a prediction but its own table.
struct DropOutput {
  DropSections sections;  // with the conditions, which are set before `complete`
  std::optional<MeasuredDrop> measured;
  std::optional<MeasuredComparison> comparison;
};

// That a figure is at most a limit.
using ProbabilityWithin = std::function<double(std::size_t figure, double limit)>;

// What a prediction is of, as it falls, and what it says.
struct PredictionOf {
  const config::ModelSpec& model;  // of the curve
  // With everything that is open; null: the prediction has no band.
  const estimator::IdentifiedDamper* damper = nullptr;
  const PredictedDrop& predicted;
  ProbabilityWithin probability;
};

// Fills the sections and compares with the measured drop where one is given. An Error is that of a
// file, a drop, or an option.
Result<void> complete(const DropOptions& options, const PredictionOf& prediction, DropOutput& out);

// The band of a drop as the options want it.
estimator::MixtureOptions mixture_options(const DropOptions& options);

// What widens the band beyond the tested velocities: a sentence.
std::string prior_words(const estimator::ExtrapolationPriors& priors);

// A drop that gives no answer is not usable; everything else is bad input.
ExitCode drop_exit_code(const Error& error);

std::string drop_output_text(const DropOutput& output);
// The measured drop beside the prediction; nothing where none was given.
std::string comparison_text(const DropOutput& output);
void add_drop_output(const DropOutput& output, nlohmann::ordered_json& json);

// The file of --svg. An Error if it cannot be written.
Result<void> write_drop_picture(const DropOptions& options, const DropOutput& output,
                                const estimator::DropRun& run, const estimator::HistoryBand& band,
                                const estimator::DropHistory* truth, const std::string& length);

}  // namespace shaker::cli
