// Decompositions of dense matrices, and solutions with them. dense.cpp and dense_analysis.cpp
// compile each of Eigen's templates once, because they cost seconds of compile time in every file
// that uses them. What a service on the rig needs is in dense.cpp.
//
// Vectors and matrices may have any size, an empty matrix only where Eigen's decomposition
// allows it. Nothing throws. All functions are thread-safe, and all allocate.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/QR>

namespace shaker::estimator {

// Eigenvalues in ascending order, and the eigenvectors in that order as columns.
struct Spectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Spectrum spectrum_of(const Eigen::MatrixXd& symmetric);

// A symmetric matrix as q t q^T with a tridiagonal t, for a fraction of the work of a spectrum.
class Tridiagonal {
 public:
  explicit Tridiagonal(const Eigen::MatrixXd& symmetric);
  const Eigen::VectorXd& diagonal() const { return diagonal_; }
  const Eigen::VectorXd& beside() const { return beside_; }
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& b) const;  // q^T b

 private:
  Eigen::VectorXd diagonal_, beside_, factors_;
  Eigen::MatrixXd reflectors_;
};

// For a square matrix that need not be symmetric. The columns of `vectors` have length one.
struct ComplexSpectrum {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
ComplexSpectrum complex_spectrum_of(const Eigen::MatrixXd& square);
Eigen::VectorXcd eigenvalues_of(const Eigen::MatrixXd& square);

// Singular values a = u diag(values) v^T, thin: u is rows x r, v is columns x r, with
// r = min(rows, columns). The values descend.
struct SingularValues {
  Eigen::MatrixXd u, v;
  Eigen::VectorXd values;
};
SingularValues singular_values_of(const Eigen::MatrixXd& a);
// The same with v of size columns x columns.
SingularValues singular_values_with_full_v(const Eigen::MatrixXd& a);

// a = l l^T for a symmetric positive definite matrix. Only the lower half of `a` is read.
class Cholesky {
 public:
  explicit Cholesky(const Eigen::MatrixXd& a);
  bool positive() const;         // false: a is not positive definite; other results are invalid
  Eigen::MatrixXd root() const;  // l, with zeros above its diagonal
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  // l^-1 b
  Eigen::VectorXd whiten(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd whiten(const Eigen::MatrixXd& b) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

// a = p^T l d l^T p for a symmetric matrix that is positive or negative semidefinite.
class Ldlt {
 public:
  explicit Ldlt(const Eigen::MatrixXd& a);
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

// a p = q r with column pivoting, by Householder reflections.
class PivotedQr {
 public:
  explicit PivotedQr(const Eigen::MatrixXd& a);
  // A pivot below `share` of the largest counts as zero. Default: Eigen's own threshold.
  void set_threshold(double share);
  Eigen::Index rank() const;
  Eigen::VectorXd pivots() const;                           // the diagonal of r
  Eigen::MatrixXd basis(Eigen::Index columns) const;        // the first columns of q
  Eigen::VectorXd rotated(const Eigen::VectorXd& b) const;  // q^T b
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& b) const;
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  // minimises |a x - b|
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor_;
};

// Without pivoting: a = q r, for a matrix with at least as many rows as columns.
class TallQr {
 public:
  explicit TallQr(const Eigen::MatrixXd& a);
  Eigen::MatrixXd r() const;                                // columns x columns
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& b) const;  // q^T b

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> factor_;
};
// q (rows x rows), without pivoting.
Eigen::MatrixXd orthogonal_factor(const Eigen::MatrixXd& a);
// Leaves r in the upper half of `a`, and the Householder vectors below it.
void triangularise(Eigen::Ref<Eigen::MatrixXd> a);

// a^-1 b for a square matrix, by elimination with row exchanges; inf or NaN if it is singular.
Eigen::VectorXd solve_square(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd solve_square(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a);

// Products and solutions with the lower half of l, including its diagonal: l b, l^T b, l^-1 b.
Eigen::MatrixXd lower_times(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b);
Eigen::VectorXd lower_transposed_times(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);
Eigen::VectorXd lower_solve(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);
Eigen::MatrixXd lower_solve(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b);

// Add to the lower half of `sum`: rows^T rows, or weight p p^T. The upper half does not change.
void add_gram(Eigen::MatrixXd& sum, const Eigen::MatrixXd& rows);
void add_square(Eigen::MatrixXd& sum, const Eigen::VectorXd& p, double weight = 1.0);
Eigen::MatrixXd symmetric_of_lower(const Eigen::MatrixXd& lower);

// Minimises |a x - b| for each column of b. `a` has full column rank.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
// The same by singular values, as programs of 1991 solve it.
Eigen::VectorXd least_squares_by_singular_values(const Eigen::MatrixXd& a,
                                                 const Eigen::VectorXd& b);
// The shortest x that minimises |a x - b|, for a matrix of any rank.
Eigen::MatrixXd shortest_least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace shaker::estimator
