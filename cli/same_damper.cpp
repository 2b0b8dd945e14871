#include "cli/same_damper.hpp"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "estimator/fit/run_comparison.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

// Empty where the campaign has no estimate by itself.
std::vector<estimator::ParameterAlone> campaign_alone(const InputOptions& options,
                                                      const std::filesystem::path& place) {
  InputOptions alone = options;
  alone.files = {place};
  auto input = read_estimation_input(alone);
  if (!input || input->spoiled) return {};
  try {
    return estimator::estimated_alone(estimator::Model(input->model), std::move(input->runs));
  } catch (const std::invalid_argument&) {
    return {};  // the estimate of all says what is wrong with the model
  }
}

}  // namespace

std::optional<std::string> disagreement(const InputOptions& options) {
  if (options.files.size() < 2 || !options.periods.empty()) return std::nullopt;
  const auto first = campaign_alone(options, options.files.front());
  if (first.empty()) return std::nullopt;
  for (std::size_t i = 1; i < options.files.size(); ++i) {
    const auto other = campaign_alone(options, options.files[i]);
    const auto worst = estimator::disagreement(first, other);
    if (!worst) continue;
    const auto said = [&](const estimator::ParameterAlone& p) {
      return report::with_error(p.value, p.standard_error);
    };
    return fmt::format(
        "{} and {} do not agree: {} is {} by one and {} by the other. They are of two dampers, of "
        "one that changed, or the model lacks an effect: estimate them apart, or diagnose them",
        options.files.front().string(), options.files[i].string(), first[*worst].name,
        said(first[*worst]), said(other[*worst]));
  }
  return std::nullopt;
}

std::optional<std::string> disagreement(const std::vector<std::filesystem::path>& campaigns,
                                        const std::filesystem::path& model) {
  InputOptions options;
  options.files = campaigns;
  options.model = model;
  return disagreement(options);
}

}  // namespace shaker::cli
