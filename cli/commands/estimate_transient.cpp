// Estimates from a record that is not periodic.
#include <stdexcept>

#include <fmt/format.h>

#include "cli/commands.hpp"
#include "cli/transient_data.hpp"
#include "config/model.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

constexpr std::size_t kLong = 5000;  // samples; above it fixed steps are faster

estimator::Integrator integrator_of(const EstimateOptions& options, std::size_t samples) {
  if (options.integrator == "rk4") return estimator::Integrator::runge_kutta4;
  if (options.integrator == "sdirk4") return estimator::Integrator::sdirk4;
  if (options.integrator == "bdf") return estimator::Integrator::bdf;
  if (options.integrator == "adams") return estimator::Integrator::adams;
  return samples > kLong ? estimator::Integrator::runge_kutta4 : estimator::Integrator::adams;
}

}  // namespace

int estimate_transient(const Common& common, const EstimateOptions& options) {
  if (options.frequency_hz || options.amplitude || options.starts > 1)
    return fail(common, kBadInput,
                "a transient record has its excitation in its columns; leave --frequency, "
                "--amplitude and --starts out");
  if (options.files.size() > 1)
    return fail(common, kBadInput, "a transient record is one CSV file; give one");
  if (options.bias == "always")
    return fail(common, kBadInput,
                "the bias of a transient record's estimate is not known; leave --bias out");
  if (options.model.empty())
    return fail(common, kBadInput, "a CSV file does not say which model; give --model MODEL.json");
  auto spec = config::load_model(options.model);
  if (!spec) return fail(common, kBadInput, spec.error().what);
  auto record = transient_from_csv(options.file(), spec->length_unit);
  if (!record) return fail(common, kBadInput, record.error().what);
  try {
    const estimator::Model model(*spec);
    for (const double value : options.initial)
      record->initial.push_back({value, true});
    estimator::TransientOptions how;
    how.time.integrator = integrator_of(options, record->t.size());
    estimator::TransientEstimator estimator(model, {std::move(*record)}, how);
    const auto& fit = estimator.fit(model.start());
    if (fit.status == estimator::FitStatus::no_solution)
      return fail(common, kNotUsable, fit.trouble);
    protocol::EstimateDocument document = report::to_document(estimator.describe());
    document.clock = "recorded";
    fmt::print("{}", common.json ? protocol::to_json_text(document) + "\n"
                                 : report::estimate_table(document));
    if (document.usable) return kOk;
    if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
