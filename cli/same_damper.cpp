#include "cli/same_damper.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/estimation.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

// Standard errors are those of noise alone: a difference that matters is also one of size.
constexpr double kSurelyApart = 8.0, kApartInSize = 0.01;

struct AloneFit {
  std::filesystem::path place;
  std::vector<std::string> names;
  std::vector<double> theta, error;
};

std::optional<AloneFit> fitted_alone(const InputOptions& options,
                                     const std::filesystem::path& place) {
  InputOptions alone = options;
  alone.files = {place};
  auto input = read_estimation_input(alone);
  if (!input || input->spoiled) return std::nullopt;
  try {
    const estimator::Model model(input->model);
    estimator::Estimator estimator(model, std::move(input->runs));
    const estimator::Fit& fit = estimator.fit(model.start());
    if (fit.status != estimator::FitStatus::converged) return std::nullopt;
    AloneFit found = {place, {}, {}, {}};
    for (std::size_t k = 0; k < fit.theta.size(); ++k) {
      if (model.parameters()[k].fixed || !(fit.standard_error[k] > 0.0)) continue;
      found.names.push_back(model.parameters()[k].name);
      found.theta.push_back(fit.theta[k]);
      found.error.push_back(fit.standard_error[k]);
    }
    return found;
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // the estimate of all says what is wrong with the model
  }
}

}  // namespace

std::optional<std::string> disagreement(const InputOptions& options) {
  if (options.files.size() < 2 || !options.periods.empty()) return std::nullopt;
  const auto first = fitted_alone(options, options.files.front());
  if (!first) return std::nullopt;
  for (std::size_t i = 1; i < options.files.size(); ++i) {
    const auto other = fitted_alone(options, options.files[i]);
    if (!other || other->names != first->names) continue;
    std::size_t worst = 0;
    double most = 0.0;
    for (std::size_t k = 0; k < first->names.size(); ++k) {
      const double off = std::fabs(other->theta[k] - first->theta[k]);
      const double apart = off / std::hypot(other->error[k], first->error[k]);
      if (apart <= most || off < kApartInSize * std::fabs(first->theta[k])) continue;
      most = apart;
      worst = k;
    }
    if (most < kSurelyApart) continue;
    return fmt::format(
        "{} and {} do not agree: {} is {} by one and {} by the other. They are of two dampers, of "
        "one that changed, or the model lacks an effect: estimate them apart, or diagnose them",
        first->place.string(), other->place.string(), first->names[worst],
        report::with_error(first->theta[worst], first->error[worst]),
        report::with_error(other->theta[worst], other->error[worst]));
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
