#include "estimator/math/accelerated_course.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

// Steps that take a half and a tenth of the way, along two directions, to (1, 2).
VectorXd step_at(const VectorXd& place) {
  Matrix2d share;
  share << 0.3, 0.2, 0.2, 0.3;
  return share * (Vector2d(1.0, 2.0) - place);
}

double distance_after(int calls, bool straight) {
  const MatrixXd weight = Vector2d(1.0, 4.0).asDiagonal();
  AcceleratedCourse course;
  VectorXd place = VectorXd::Zero(2);
  for (int call = 0; call < calls; ++call)
    place += course.next(step_at(place), weight, straight);
  return (place - Vector2d(1.0, 2.0)).norm();
}

TEST(AcceleratedCourse, OfALinearIterationEndsAfterOneStepMoreThanUnknownsAndOne) {
  EXPECT_GT(distance_after(4, false), 0.1);
  EXPECT_LT(distance_after(4, true), 1e-6);
}

TEST(AcceleratedCourse, IsTheIterationsOwnWhereItIsNotStraight) {
  const MatrixXd weight = MatrixXd::Identity(2, 2);
  AcceleratedCourse course;
  course.next(Vector2d(1.0, 0.0), weight, true);
  EXPECT_EQ(course.next(Vector2d(0.5, 0.1), weight, false), Vector2d(0.5, 0.1));
  // And it has forgotten what was before.
  EXPECT_EQ(course.next(Vector2d(0.25, 0.0), weight, true), Vector2d(0.25, 0.0));
}

TEST(AcceleratedCourse, TakesNoStepThatIsLongerByOrders) {
  const MatrixXd weight = MatrixXd::Identity(2, 2);
  AcceleratedCourse course;
  course.next(Vector2d(1.0, 0.0), weight, true);
  // A step that hardly changes promises the end far away.
  EXPECT_LE(course.next(Vector2d(0.999, 0.0), weight, true).norm(), 30.0);
}

}  // namespace
}  // namespace shaker::estimator
