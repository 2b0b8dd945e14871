// Decompositions of small dense matrices, each of Eigen's compiled once: its templates take seconds
// in every file that uses them. Thread-safe; all allocate.
#pragma once

#include <Eigen/Core>

namespace shaker::estimator {

// Eigenvalues in ascending order, and the eigenvectors in that order as columns.
struct Spectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Spectrum spectrum_of(const Eigen::MatrixXd& symmetric);

// a = u diag(values) v^T, thin: u is rows x r, v is columns x r, r = min(rows, columns); values
// descend.
struct SingularValues {
  Eigen::MatrixXd u, v;
  Eigen::VectorXd values;
};
SingularValues singular_values_of(const Eigen::MatrixXd& a);

// x that makes |a x - b| smallest, for each column of b: a has full column rank.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// The shortest of the x that make |a x - b| smallest: a of any rank.
Eigen::MatrixXd shortest_least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace shaker::estimator
