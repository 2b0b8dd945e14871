#include "estimator/solve/periodic/floquet.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "estimator/math/aligned.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kStages = 3;
constexpr int kDeepest = 24;            // halvings of an interval
constexpr int kMaxIntervalSteps = 128;  // in an interval; two kinks take about 100
constexpr double kRoot6 = 2.449489742783178;
constexpr double kC[kStages] = {(4 - kRoot6) / 10, (4 + kRoot6) / 10, 1.0};
constexpr double kA[kStages][kStages] = {
    {(88 - 7 * kRoot6) / 360, (296 - 169 * kRoot6) / 1800, (-2 + 3 * kRoot6) / 225},
    {(296 + 169 * kRoot6) / 1800, (88 + 7 * kRoot6) / 360, (-2 - 3 * kRoot6) / 225},
    {(16 - kRoot6) / 36, (16 + kRoot6) / 36, 1.0 / 9}};

constexpr double squared(int j, int l) {
  double sum = 0.0;
  for (int k = 0; k < kStages; ++k)
    sum += kA[j][k] * kA[k][l];
  return sum;
}

constexpr int kPoints = 3 * kStages + 1;

// Time of point k as a share of the step: first the stages of the step, then those of its two
// halves, then the start of the step, where there is no stage.
double stage_time(int k) {
  if (k == kPoints - 1) return 0.0;
  const int part = k / kStages;
  const double c = kC[k % kStages];
  return part == 0 ? c : 0.5 * (part - 1 + c);
}

// The highest derivative of a coordinate in the equations: acceleration, velocity, or none.
enum class Kind { massive, first_order, algebraic };

// Weights (absolute sum 1) of the divided difference over the points from `first` on. The stage at
// the end of the step is left out because the second half has a stage there too. The difference is
// very small for smooth derivatives and not small where they have a kink. The comparison of a step
// with its halves misses a kink at certain positions; this test misses it at others.
struct Corner {
  double weight[kPoints] = {};

  explicit Corner(int first) {
    double sum = 0.0;
    for (int k = first; k < kPoints; ++k) {
      if (k == kStages - 1) continue;
      double product = 1.0;
      for (int m = first; m < kPoints; ++m) {
        if (m != k && m != kStages - 1) product *= stage_time(k) - stage_time(m);
      }
      weight[k] = 1.0 / product;
      sum += std::fabs(weight[k]);
    }
    for (double& w : weight)
      w /= sum;
  }
  double at(const double* slope) const {
    double sum = 0.0;
    for (int k = 0; k < kPoints; ++k)
      sum += weight[k] * slope[k];
    return std::fabs(sum);
  }
};

class Variation {
 public:
  Variation(const PeriodicSystem& system, std::span<const double> theta);
  int size() const { return size_; }
  // Computes the monodromy matrix of u and v / (2 pi f); returns false when the equations are
  // singular. `course` (may be null) gets one row for each grid point: the derivative of the
  // observed coordinate there over the state at the first point.
  bool monodromy(double tolerance, MatrixXd& out, double& error, MatrixXd* course = nullptr);

 private:
  bool interval(int i, double from, double length, int depth, double tolerance, MatrixXd& out);
  bool evaluate(int i, double from, double length);
  bool step(int first_point, double h, MatrixXd& out);
  double corner_error(double h) const;
  bool grazes(int depth) const;

  const PeriodicSystem& system_;
  std::span<const double> theta_;
  int steps_ = 0;  // in this interval
  int s_, size_ = 0;
  double omega_, spacing_, error_ = 0.0;
  std::vector<Kind> kind_;
  std::vector<Index> place_;  // index of a coordinate's u in the state; its v follows
  AlignedVector store_, x_;
  std::vector<double*> u_, v_, a_, g_, g_u_, g_v_, g_a_, g_theta_, scratch_;
};

Variation::Variation(const PeriodicSystem& system, std::span<const double> theta)
    : system_(system),
      theta_(theta),
      s_(system.model().coordinates()),
      omega_(2.0 * std::numbers::pi * system.frequency()),
      spacing_(1.0 / (system.frequency() * system.points())) {
  for (int c = 0; c < s_; ++c) {
    bool mass = false, damping = false;
    for (int i = 0; i < system.points(); ++i) {
      for (int d = 0; d < s_; ++d) {
        mass = mass || system.g_a(i, d, c) != 0.0;
        damping = damping || system.g_v(i, d, c) != 0.0;
      }
    }
    kind_.push_back(mass ? Kind::massive : damping ? Kind::first_order : Kind::algebraic);
    place_.push_back(size_);
    size_ += mass ? 2 : damping ? 1 : 0;
  }
  constexpr int kPadded = 16;
  store_.resize(point_arrays(system.model()) * kPadded);
  x_.resize(kPadded);
  cut_point_arrays(system.model(), store_.data(), kPadded,
                   {u_, v_, a_, g_, g_u_, g_v_, g_a_, g_theta_, scratch_});
}

// Evaluates the partial derivatives at all stages of the step and of its two halves. Between grid
// points the solution is the quintic through u, v and a at both ends.
bool Variation::evaluate(int i, double from, double length) {
  const int next = (i + 1) % system_.points();
  const double h = spacing_;
  for (int k = 0; k < kPoints; ++k) {
    const double t = from + length * stage_time(k);
    for (int e = 0; e < s_; ++e) {
      const double u0 = system_.value(i, e);
      const double v0 = h * system_.velocity(i, e);
      const double a0 = 0.5 * h * h * system_.acceleration(i, e);
      const double u1 = system_.value(next, e) - u0 - v0 - a0;
      const double v1 = h * system_.velocity(next, e) - v0 - 2.0 * a0;
      const double a1 = 0.5 * h * h * system_.acceleration(next, e) - a0;
      const double c3 = 10 * u1 - 4 * v1 + a1;
      const double c4 = -15 * u1 + 7 * v1 - 2 * a1;
      const double c5 = 6 * u1 - 3 * v1 + a1;
      u_[e][k] = u0 + t * (v0 + t * (a0 + t * (c3 + t * (c4 + t * c5))));
      v_[e][k] = (v0 + t * (2 * a0 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))) / h;
      a_[e][k] = (2 * a0 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5))) / (h * h);
    }
    x_[k] = (1.0 - t) * system_.excitation()[i] + t * system_.excitation()[next];
  }
  const ModelPoints points{kPoints, u_.data(), v_.data(), a_.data(), x_.data()};
  return system_.model().evaluate(
      points, theta_.data(),
      {g_.data(), g_u_.data(), g_v_.data(), g_a_.data(), g_theta_.data(), scratch_.data()});
}

// Computes the matrix of one Radau step of length h on the state. The unknown of each stage is the
// highest derivative of every coordinate in the equations; the lower ones follow from it.
bool Variation::step(int first_point, double h, MatrixXd& out) {
  const Index unknowns = kStages * s_;
  MatrixXd left = MatrixXd::Zero(unknowns, unknowns);
  MatrixXd right = MatrixXd::Zero(unknowns, size_);
  for (int j = 0; j < kStages; ++j) {
    const int k = first_point + j;
    for (int d = 0; d < s_; ++d) {
      const Index row = j * s_ + d;
      for (int c = 0; c < s_; ++c) {
        const double u = g_u_[d * s_ + c][k], v = g_v_[d * s_ + c][k], a = g_a_[d * s_ + c][k];
        switch (kind_[c]) {
          case Kind::massive:
            for (int l = 0; l < kStages; ++l)
              left(row, l * s_ + c) =
                  (j == l ? a : 0.0) + h * kA[j][l] * v + h * h * squared(j, l) * u;
            right(row, place_[c]) = -u;
            right(row, place_[c] + 1) = -omega_ * (v + h * kC[j] * u);
            break;
          case Kind::first_order:
            for (int l = 0; l < kStages; ++l)
              left(row, l * s_ + c) = (j == l ? v : 0.0) + h * kA[j][l] * u;
            right(row, place_[c]) = -u;
            break;
          case Kind::algebraic:
            left(row, j * s_ + c) = u;
            break;
        }
      }
    }
  }
  const MatrixXd stages = solve_square(left, right);
  if (!stages.allFinite()) return false;
  out.setIdentity(size_, size_);
  for (int c = 0; c < s_; ++c) {
    const Index u = place_[c];
    if (kind_[c] == Kind::algebraic) continue;
    if (kind_[c] == Kind::massive) out(u, u + 1) = omega_ * h;
    for (int l = 0; l < kStages; ++l) {
      if (kind_[c] == Kind::massive) {
        out.row(u) += h * h * squared(kStages - 1, l) * stages.row(l * s_ + c);
        out.row(u + 1) += h * kA[kStages - 1][l] / omega_ * stages.row(l * s_ + c);
      } else {
        out.row(u) += h * kA[kStages - 1][l] * stages.row(l * s_ + c);
      }
    }
  }
  return true;
}

double Variation::corner_error(double h) const {
  static const Corner corners[] = {Corner(0), Corner(1)};
  double error = 0.0, mass = 0.0;
  for (int de = 0; de < s_ * s_; ++de) {
    mass = std::max(mass, std::fabs(g_a_[de][0]));
    for (const Corner& corner : corners)
      error = std::max(error, h * (corner.at(g_v_[de]) + h * corner.at(g_u_[de])));
  }
  return mass > 0.0 ? error / mass : 0.0;
}

// True if a velocity has an extreme so close to zero that it may cross zero twice between two
// stages. Neither error estimate sees these two kinks, so the interval is halved further.
bool Variation::grazes(int depth) const {
  if (depth >= kDeepest / 2) return false;
  for (int c = 0; c < s_; ++c) {
    const auto [least, most] = std::minmax_element(v_[c], v_[c] + kPoints);
    const auto [slowest, fastest] = std::minmax_element(a_[c], a_[c] + kPoints);
    const double nearest = *least > 0.0 ? *least : *most < 0.0 ? -*most : 0.0;
    if (nearest > 0.0 && (*slowest < 0.0) != (*fastest < 0.0) && nearest < 4.0 * (*most - *least))
      return true;
  }
  return false;
}

bool Variation::interval(int i, double from, double length, int depth, double tolerance,
                         MatrixXd& out) {
  if (!evaluate(i, from, length)) return false;
  const double h = length * spacing_;
  MatrixXd whole, first, second;
  if (!step(0, h, whole) || !step(kStages, 0.5 * h, first) || !step(2 * kStages, 0.5 * h, second))
    return false;
  MatrixXd product = second * first;
  const double error = std::max((product - whole).cwiseAbs().maxCoeff() / 31.0, corner_error(h));
  // Extreme parameters, where a failed fit may end, would take very many steps. The limits end the
  // refinement; the error then shows that the multipliers are inaccurate.
  if ((error <= tolerance && !grazes(depth)) || depth == kDeepest || ++steps_ > kMaxIntervalSteps) {
    error_ += error;
    out = std::move(product);
    return true;
  }
  if (!interval(i, from, 0.5 * length, depth + 1, tolerance, first) ||
      !interval(i, from + 0.5 * length, 0.5 * length, depth + 1, tolerance, second))
    return false;
  out = second * first;
  return true;
}

bool Variation::monodromy(double tolerance, MatrixXd& out, double& error, MatrixXd* course) {
  out.setIdentity(size_, size_);
  const auto seen = static_cast<std::size_t>(system_.model().observed());
  if (course != nullptr) course->setZero(system_.points(), size_);
  MatrixXd one;
  for (int i = 0; i < system_.points(); ++i) {
    if (course != nullptr && kind_[seen] != Kind::algebraic) course->row(i) = out.row(place_[seen]);
    steps_ = 0;
    if (!interval(i, 0.0, 1.0, 0, tolerance / system_.points(), one)) return false;
    out = one * out;
  }
  error = error_;
  return true;
}

}  // namespace

Result<Floquet> floquet(const PeriodicSystem& system, std::span<const double> theta,
                        double tolerance) {
  Variation variation(system, theta);
  MatrixXd monodromy;
  Floquet result;
  if (!variation.monodromy(tolerance, monodromy, result.error))
    return Error{ErrorKind::not_converged,
                 "the stability of the periodic solution cannot be told: the equations do not "
                 "determine the highest derivatives along it"};
  const Eigen::VectorXcd eigenvalues = eigenvalues_of(monodromy);
  result.multipliers.assign(eigenvalues.begin(), eigenvalues.end());
  std::sort(result.multipliers.begin(), result.multipliers.end(), [](const auto& a, const auto& b) {
    return std::abs(a) != std::abs(b) ? std::abs(a) > std::abs(b) : a.imag() > b.imag();
  });
  return result;
}

Result<std::vector<FloquetMode>> floquet_modes(const PeriodicSystem& system,
                                               std::span<const double> theta, double tolerance) {
  Variation variation(system, theta);
  MatrixXd monodromy, course;
  double error = 0.0;
  if (!variation.monodromy(tolerance, monodromy, error, &course))
    return Error{ErrorKind::not_converged,
                 "the decay towards the periodic solution cannot be told: the equations do not "
                 "determine the highest derivatives along it"};
  const ComplexSpectrum eigen = complex_spectrum_of(monodromy);
  const Eigen::MatrixXcd shapes = course * eigen.vectors;
  std::vector<FloquetMode> modes;
  for (Index k = 0; k < monodromy.rows(); ++k) {
    const std::complex<double> multiplier = eigen.values[k];
    if (multiplier.imag() < 0.0) continue;
    modes.push_back({multiplier, {shapes.col(k).begin(), shapes.col(k).end()}});
  }
  std::sort(modes.begin(), modes.end(), [](const FloquetMode& a, const FloquetMode& b) {
    return std::abs(a.multiplier) > std::abs(b.multiplier);
  });
  return modes;
}

}  // namespace shaker::estimator
