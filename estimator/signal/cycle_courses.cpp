#include "estimator/signal/cycle_courses.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

// Takes the unit vector's part out of `values`; returns its size.
double take_out_one(std::span<double> values, const double* unit) {
  double size = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k)
    size += unit[k] * values[k];
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] -= size * unit[k];
  return size;
}

}  // namespace

CycleCourses::CycleCourses(std::size_t cycles, const std::vector<std::vector<double>>& courses)
    : cycles_(cycles),
      courses_(courses.size()),
      basis_(cycles, 1.0 / std::sqrt(static_cast<double>(cycles))) {
  for (std::vector<double> course : courses) {
    for (int round = 0; round < 2; ++round) {  // the second for what rounding leaves of the first
      for (std::size_t at = 0; at < basis_.size(); at += cycles_)
        take_out_one(course, &basis_[at]);
    }
    double square = 0.0;
    for (const double value : course)
      square += value * value;
    for (const double value : course)
      basis_.push_back(value / std::sqrt(square));
  }
}

CycleCourses CycleCourses::trend(std::size_t cycles) {
  std::vector<double> line;
  for (std::size_t k = 0; k < cycles; ++k)
    line.push_back(static_cast<double>(k));
  return CycleCourses(cycles, {line});
}

CycleCourses CycleCourses::repeating(std::size_t cycles, int periods) {
  std::vector<std::vector<double>> courses;
  for (int term = 1; term < periods; ++term) {
    courses.emplace_back();
    for (std::size_t k = 0; k < cycles; ++k)
      courses.back().push_back(
          harmonic_term(term, static_cast<int>(k % static_cast<std::size_t>(periods)), periods));
  }
  return CycleCourses(cycles, courses);
}

CycleCourses::Split& CycleCourses::Split::operator+=(const Split& other) {
  follows += other.follows;
  rest += other.rest;
  return *this;
}

CycleCourses::Split CycleCourses::take_out(std::span<double> values) const {
  Split split;
  take_out_one(values, basis_.data());
  for (std::size_t at = cycles_; at < basis_.size(); at += cycles_) {
    const double size = take_out_one(values, &basis_[at]);
    split.follows += size * size;
  }
  for (const double value : values)
    split.rest += value * value;
  return split;
}

double CycleCourses::by_chance(const Split& split, double numbers, double least) const {
  const auto courses = static_cast<double>(courses_);
  return probability_by_chance(split, numbers * courses,
                               numbers * (static_cast<double>(cycles_) - 1.0 - courses), least);
}

double probability_by_chance(const CycleCourses::Split& split, double numbers_that_follow,
                             double numbers_left, double least) {
  if (numbers_left < 1.0 || !(split.follows > 0.0)) return 1.0;
  const double ratio = split.follows / numbers_that_follow / (split.rest / numbers_left + least);
  return std::isfinite(ratio) ? fisher_f_above(ratio, numbers_that_follow, numbers_left) : 0.0;
}

}  // namespace shaker::estimator
