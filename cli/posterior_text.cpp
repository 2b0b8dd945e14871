#include "cli/posterior_text.hpp"

#include <cmath>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

std::string sampling_sentence(const estimator::Posterior& posterior) {
  if (posterior.method == estimator::PosteriorMethod::importance)
    return fmt::format("by importance sampling ({} draws; tail of their weights {:.2f})",
                       posterior.samples, posterior.pareto_k);
  return fmt::format(
      "by ensembles of walkers ({} draws; split R-hat {:.3f}), begun where importance sampling "
      "ended (tail of its weights {:.2f})",
      posterior.samples, posterior.r_hat, posterior.pareto_k);
}

}  // namespace

nlohmann::ordered_json posterior_json(const estimator::Posterior& posterior,
                                      const std::vector<std::string>& names) {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < posterior.parameters.size(); ++k) {
    const estimator::PosteriorMarginal& p = posterior.parameters[k];
    list.push_back({{"name", names[k]},
                    {"mean", p.mean},
                    {"median", p.median},
                    {"mode", p.mode},
                    {"standard_deviation", p.standard_deviation},
                    {"effective_samples", p.effective_samples}});
  }
  return list;
}

nlohmann::ordered_json sampling_of(const estimator::Posterior& posterior) {
  const bool ensembles = posterior.method == estimator::PosteriorMethod::ensembles;
  nlohmann::ordered_json out = {{"method", ensembles ? "ensembles" : "importance"},
                                {"draws", posterior.samples},
                                {"effective_samples", posterior.effective_samples},
                                {"converged", posterior.converged}};
  if (std::isfinite(posterior.pareto_k)) out["pareto_k"] = posterior.pareto_k;
  if (ensembles && std::isfinite(posterior.r_hat)) out["r_hat"] = posterior.r_hat;
  return out;
}

std::string posterior_table(const estimator::Posterior& posterior,
                            const std::vector<std::string>& names) {
  std::vector<std::vector<std::string>> rows = {
      {"parameter", "mean", "median", "mode", "deviation", "draws it is worth"}};
  for (std::size_t k = 0; k < posterior.parameters.size(); ++k) {
    const estimator::PosteriorMarginal& p = posterior.parameters[k];
    rows.push_back({names[k], fmt::format("{:.6g}", p.mean), fmt::format("{:.6g}", p.median),
                    fmt::format("{:.6g}", p.mode), fmt::format("{:.3g}", p.standard_deviation),
                    fmt::format("{:.0f}", p.effective_samples)});
  }
  return fmt::format("\nPosterior, {}:\n\n{}", sampling_sentence(posterior),
                     report::text_table(rows, std::vector<bool>(rows.front().size(), true)));
}

}  // namespace shaker::cli
