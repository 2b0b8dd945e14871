// The one statistic behind every test of repetition and of steadiness: how much of the scatter of
// cycles follows a course over the cycles. A course is a value for each cycle: a straight line for a
// drift, a pattern for a response that repeats only after some cycles. The functions are pure.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace shaker::estimator {

class CycleCourses {
 public:
  // `courses`: each of the same number of values, one a cycle; linearly independent of each other
  // and of a constant. No courses: only the mean.
  explicit CycleCourses(std::size_t cycles, const std::vector<std::vector<double>>& courses = {});
  // A straight line.
  static CycleCourses trend(std::size_t cycles);
  // All patterns that repeat after `periods` cycles: periods - 1 courses. 1: only the mean.
  // Precondition: more cycles than periods.
  static CycleCourses repeating(std::size_t cycles, int periods);

  std::size_t cycles() const { return cycles_; }
  std::size_t courses() const { return courses_; }

  // Sums of squares: what follows the courses, and what is left beside them and the mean.
  struct Split {
    double follows = 0.0, rest = 0.0;
    Split& operator+=(const Split& other);
  };
  // Takes the mean and the courses out of one number of each cycle (`values`: cycles() of them).
  // Does not allocate.
  Split take_out(std::span<double> values) const;

  // The probability that noise makes the cycles follow the courses so closely: Fisher's F of
  // `numbers` independent numbers a cycle, whose splits are summed up in `split`. `least`: the mean
  // square that courses are expected to have beside noise. 1 where too few cycles are left to tell.
  double by_chance(const Split& split, double numbers, double least = 0.0) const;

 private:
  std::size_t cycles_ = 0, courses_ = 0;
  std::vector<double> basis_;  // orthonormal; the mean's first
};

// The same for one split into courses and rest: probability of the ratio of their mean squares.
double probability_by_chance(const CycleCourses::Split& split, double numbers_that_follow,
                             double numbers_left, double least = 0.0);

}  // namespace shaker::estimator
