// The result of `shakerctl plan` as one self-contained HTML page that can be printed, and the
// words for its numbers. Pure; any thread.
#pragma once

#include <string>

#include "estimator/design/plan.hpp"
#include "report/page/page.hpp"

namespace shaker::report {

// "1 Hz 2.5, 2 Hz 3": frequencies and amplitudes of a set.
std::string names_of(const estimator::Plan& plan, const estimator::PlanSet& set);

// Half of the 95 % interval of free parameter `k`, in per cent of its value `theta`, or of 1 when
// that is 0. NaN where the set does not determine it.
double half_interval(const estimator::PlanSet& set, std::size_t k, double theta);

// "3.1 %", or "open" for what is not finite.
std::string percent(double value);

std::string plan_page(const estimator::Model& model, const estimator::PlanOptions& options,
                      const estimator::Plan& plan, const TitleBlock& title = {});

}  // namespace shaker::report
