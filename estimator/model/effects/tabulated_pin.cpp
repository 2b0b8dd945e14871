#include "estimator/model/effects/tabulated_pin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

constexpr int kMostOwn = static_cast<int>(config::kMostKnots) - 1;  // parameters
constexpr double kWidestFall = 4.6;                                 // ln of a hundredth
constexpr double kLargestPower = 14.0;  // of e in 1 / area^2: an area of a thousandth
constexpr double kOtherShape = 6.0;     // furthest r from the table's, ln
constexpr double kFlattest = 1e-3;      // slope of a flat interval, of the mean one

// One number that depends on the shape, with its derivatives over r2...
struct Shaped {
  double value = 0.0;
  std::array<double, kMostOwn> d{};
};

// ln(A_1 / A) over its whole fall: 0 at the first knot, 1 at the last. Values and slopes there.
class Shape {
 public:
  Shape(const std::vector<double>& knots, const double* r)
      : knots_(knots), n_(static_cast<int>(knots.size())) {
    std::array<Shaped, config::kMostKnots> slopes;
    secants(r, slopes);
    for (int i = 0; i + 1 < n_; ++i) {
      at_[i + 1].value = at_[i].value + width(i) * slopes[i].value;
      for (int k = 0; k < n_ - 2; ++k)
        at_[i + 1].d[k] = at_[i].d[k] + width(i) * slopes[i].d[k];
    }
    slope_[0] = slopes[0];
    slope_[n_ - 1] = slopes[n_ - 2];
    for (int i = 1; i + 1 < n_; ++i)
      slope_[i] = between(width(i - 1), slopes[i - 1], width(i), slopes[i]);
  }

  // Value and slope over the stroke; the derivatives over r2.. of the value.
  void at(double u, Shaped& value, double& slope) const {
    const int last = n_ - 1;
    if (!(u > knots_.front() && u < knots_.back())) {  // also of what is no number
      const int end = u <= knots_.front() ? 0 : last;
      slope = slope_[end].value;
      blend({1.0, u - knots_[end], 0.0, 0.0}, end, end, value);
      return;
    }
    const auto above = std::upper_bound(knots_.begin(), knots_.end(), u);
    const int i = static_cast<int>(above - knots_.begin()) - 1;
    const double h = width(i), t = (u - knots_[i]) / h, s = 1.0 - t;
    blend({(1.0 + 2.0 * t) * s * s, h * t * s * s, t * t * (3.0 - 2.0 * t), -h * t * t * s}, i,
          i + 1, value);
    slope = 6.0 * t * s * (at_[i + 1].value - at_[i].value) / h +
            s * (1.0 - 3.0 * t) * slope_[i].value + t * (3.0 * t - 2.0) * slope_[i + 1].value;
  }

 private:
  double width(int i) const { return knots_[i + 1] - knots_[i]; }

  void secants(const double* r, std::array<Shaped, config::kMostKnots>& slopes) const {
    std::array<double, config::kMostKnots> grown{}, share{};
    double log_slope = 0.0, sum = 0.0, top = 0.0;
    for (int i = 0; i + 1 < n_; ++i) {
      if (i > 0) log_slope += r[i - 1];
      grown[i] = log_slope;
      top = std::max(top, log_slope);
    }
    for (int i = 0; i + 1 < n_; ++i) {
      grown[i] = std::exp(grown[i] - top);
      sum += width(i) * grown[i];
    }
    for (int i = n_ - 2; i >= 0; --i)  // the share of this interval and of those after it
      share[i] = share[i + 1] + width(i) * grown[i] / sum;
    for (int i = 0; i + 1 < n_; ++i) {
      slopes[i].value = grown[i] / sum;
      for (int k = 0; k < n_ - 2; ++k)
        slopes[i].d[k] = slopes[i].value * ((i >= k + 1 ? 1.0 : 0.0) - share[k + 1]);
    }
  }

  // The weighted harmonic mean keeps the cubic monotone.
  Shaped between(double h, const Shaped& left, double h_right, const Shaped& right) const {
    const double a = 2.0 * h_right + h, b = h_right + 2.0 * h;
    Shaped mean;
    if (!(left.value > 0.0 && right.value > 0.0)) return mean;
    mean.value = (a + b) / (a / left.value + b / right.value);
    const double factor = mean.value * mean.value / (a + b);
    for (int k = 0; k < n_ - 2; ++k)
      mean.d[k] = factor * (a * left.d[k] / (left.value * left.value) +
                            b * right.d[k] / (right.value * right.value));
    return mean;
  }

  void blend(const std::array<double, 4>& by, int i, int j, Shaped& out) const {
    out.value = by[0] * at_[i].value + by[1] * slope_[i].value + by[2] * at_[j].value +
                by[3] * slope_[j].value;
    for (int k = 0; k < n_ - 2; ++k)
      out.d[k] = by[0] * at_[i].d[k] + by[1] * slope_[i].d[k] + by[2] * at_[j].d[k] +
                 by[3] * slope_[j].d[k];
  }

  const std::vector<double>& knots_;
  int n_;
  std::array<Shaped, config::kMostKnots> at_{}, slope_{};
};

constexpr std::array<std::string_view, kMostOwn> kSymbols = {"fall", "r2", "r3", "r4",  "r5", "r6",
                                                             "r7",   "r8", "r9", "r10", "r11"};

class TabulatedPin final : public Effect {
 public:
  explicit TabulatedPin(const config::PinTable& table) : knots_(table.stroke) {
    const std::size_t n = knots_.size();
    double fall = kUnknownFall;
    std::vector<double> log_slopes(n - 1, 0.0);
    if (!table.area.empty()) {
      fall = std::log(table.area.front() / table.area.back());
      const double least = std::fabs(fall) * kFlattest / (knots_.back() - knots_.front());
      for (std::size_t i = 0; fall != 0.0 && i + 1 < n; ++i)
        log_slopes[i] =
            std::log(std::max(least, std::fabs(std::log(table.area[i] / table.area[i + 1])) /
                                         (knots_[i + 1] - knots_[i])));
    }
    parameters_.push_back({kSymbols[0], "-", fall, -kWidestFall, kWidestFall,
                           "ln of the first knot's orifice area over the last one's", 0.0});
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double r = log_slopes[i] - log_slopes[i - 1];
      parameters_.push_back({kSymbols[i], "-", r, r - kOtherShape, r + kOtherShape,
                             "ln of a slope of ln(area) over that of the interval before",
                             std::numeric_limits<double>::quiet_NaN(), table.smoothness});
    }
  }

  std::string_view name() const override { return "tabulated_pin"; }
  std::string_view formula() const override {
    return "theta1 |v| v ((A_1 / A)^2 - 1), ln(A_1 / A) = fall s(u; r2, r3, ..)";
  }
  std::string_view meaning() const override {
    return "orifice whose area over the stroke is a table (metering pin)";
  }
  std::span<const ParameterInfo> parameters() const override { return parameters_; }
  std::span<const Borrowed> borrows() const override { return kTheta1; }
  bool has_velocity_kink() const override { return true; }
  double velocity_kink(const double* theta, const double*, double u) const override {
    Shaped value;
    double slope = 0.0;
    Shape(knots_, theta + 1).at(u, value, slope);
    return 4.0 * theta[own()] * std::expm1(2.0 * theta[0] * value.value);
  }

  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    const Shape shape(knots_, theta + 1);
    const double fall = theta[0], theta1 = theta[own()];
    for (int i = 0; i < at.n; ++i) {
      Shaped s;
      double slope = 0.0;
      shape.at(at.u[i], s, slope);
      const double power = 2.0 * fall * s.value;
      if (!(power < kLargestPower)) return false;
      const double v = at.v[i], flow = std::fabs(v) * v, more = std::expm1(power);
      const double steep = 2.0 * theta1 * flow * (1.0 + more);
      out.f[i] += theta1 * flow * more;
      out.f_u[i] += steep * fall * slope;
      out.f_v[i] += 2.0 * theta1 * std::fabs(v) * more;
      out.f_theta[0][i] = steep * s.value;
      for (int k = 0; k + 1 < own(); ++k)
        out.f_theta[k + 1][i] = steep * fall * s.d[static_cast<std::size_t>(k)];
      out.f_theta[own()][i] = flow * more;
    }
    return true;
  }

 private:
  static constexpr double kUnknownFall = 0.2;
  static constexpr Borrowed kTheta1[] = {{"orifice_damping", "theta1"}};
  int own() const { return static_cast<int>(parameters_.size()); }

  std::vector<double> knots_;
  std::vector<ParameterInfo> parameters_;
};

}  // namespace

std::shared_ptr<const Effect> make_tabulated_pin(const config::PinTable& table) {
  return std::make_shared<TabulatedPin>(table);
}

PinArea pin_area(const config::PinTable& table, const double* theta, double stroke) {
  Shaped s;
  double slope = 0.0;
  Shape(table.stroke, theta + 1).at(stroke, s, slope);
  PinArea area;
  area.ratio = std::exp(-theta[0] * s.value);
  area.slopes[0] = -area.ratio * s.value;
  for (std::size_t k = 1; k + 1 < table.stroke.size(); ++k)
    area.slopes[k] = -area.ratio * theta[0] * s.d[k - 1];
  return area;
}

const Effect& tabulated_pin() {
  // Five knots along the stroke of a landing gear's damper; a model file gives its own.
  static const TabulatedPin effect({{0.0, 0.05, 0.1, 0.15, 0.2}, {}});
  return effect;
}

}  // namespace shaker::estimator
