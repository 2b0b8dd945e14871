// A metering pin as a table of knots, which a model file gives:
//
//   {"effect": "tabulated_pin", "table": {"stroke": [0, 0.05, 0.1, 0.15], "area": [90, 80, 60, 50]}}
//
// theta1 is that of the first knot's area A_1. Between the knots ln(A_1 / A) is a monotone cubic
// (the slopes of Fritsch and Butland), beyond the ends a straight line. Its parameters keep every
// table monotone:
//
//   fall       ln(A_1 / A_n), over all n knots
//   r2..       for each interval but the first: ln of its slope of ln(A_1 / A) over that of the
//              interval before
//
// Each r has a normal prior about the value of the table (0 without areas): that is the smoothness.
#pragma once

#include <memory>
#include <span>

#include "config/model.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

// Precondition: a table as the model file's reader lets pass.
std::shared_ptr<const Effect> make_tabulated_pin(const config::PinTable& table);

// The area at a stroke over that of the first knot, and its derivatives over fall, r2..
struct PinArea {
  double ratio = 1.0;
  double slopes[kMostParameters] = {};
};
// `theta`: fall, r2...
PinArea pin_area(const config::PinTable& table, const double* theta, double stroke);

}  // namespace shaker::estimator
