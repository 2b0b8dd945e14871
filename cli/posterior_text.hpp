// What `estimate --intervals posterior` says of the posterior, as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "estimator/inference/posterior.hpp"

namespace shaker::cli {

// `names`: one for each parameter of the posterior.
nlohmann::ordered_json posterior_json(const estimator::Posterior& posterior,
                                      const std::vector<std::string>& names);
nlohmann::ordered_json sampling_of(const estimator::Posterior& posterior);
std::string posterior_table(const estimator::Posterior& posterior,
                            const std::vector<std::string>& names);

}  // namespace shaker::cli
