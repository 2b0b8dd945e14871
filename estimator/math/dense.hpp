// Decompositions of dense matrices and what is done with them. Each of Eigen's templates behind
// them is compiled once, in dense.cpp: they take seconds in every file that uses them.
//
// Vectors and matrices have any size; a matrix with no rows or columns is allowed where its factor
// is. Nothing throws. All functions are thread-safe, and all allocate.
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

// Of a square matrix that need not be symmetric; the columns of `vectors` have length one.
struct ComplexSpectrum {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
ComplexSpectrum complex_spectrum_of(const Eigen::MatrixXd& square);
Eigen::VectorXcd eigenvalues_of(const Eigen::MatrixXd& square);

// a = u diag(values) v^T, thin: u is rows x r, v is columns x r, r = min(rows, columns); values
// descend.
struct SingularValues {
  Eigen::MatrixXd u, v;
  Eigen::VectorXd values;
};
SingularValues singular_values_of(const Eigen::MatrixXd& a);
// The same with a v of columns x columns.
SingularValues singular_values_with_full_v(const Eigen::MatrixXd& a);

// a = l l^T of a symmetric positive definite matrix, of which the lower half is read.
class Cholesky {
 public:
  explicit Cholesky(const Eigen::MatrixXd& a);
  bool positive() const;         // false: a was not positive definite, and the rest means nothing
  Eigen::MatrixXd root() const;  // l, with zeros above its diagonal
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  // l^-1 b
  Eigen::VectorXd whiten(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd whiten(const Eigen::MatrixXd& b) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

// a = p^T l d l^T p of a symmetric matrix that is positive or negative semidefinite.
class Ldlt {
 public:
  explicit Ldlt(const Eigen::MatrixXd& a);
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

// a p = q r with the columns pivoted, by Householder reflections.
class PivotedQr {
 public:
  explicit PivotedQr(const Eigen::MatrixXd& a);
  // A pivot below `share` of the largest counts as zero; Eigen's own threshold without this.
  void set_threshold(double share);
  Eigen::Index rank() const;
  Eigen::VectorXd pivots() const;                           // the diagonal of r
  Eigen::MatrixXd basis(Eigen::Index columns) const;        // the first columns of q
  Eigen::VectorXd rotated(const Eigen::VectorXd& b) const;  // q^T b
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& b) const;
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;  // makes |a x - b| smallest
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor_;
};

// Without pivots: q of size rows x rows; r, and the first columns of q^T b, for a with at least as
// many rows as columns.
Eigen::MatrixXd orthogonal_factor(const Eigen::MatrixXd& a);
struct Triangle {
  Eigen::MatrixXd r;
  Eigen::VectorXd rotated;
};
Triangle triangle_of(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
// Leaves r in the upper half of `a`, and what Householder's reflections need below it.
void triangularise(Eigen::Ref<Eigen::MatrixXd> a);

// a^-1 b for a square matrix, by elimination with row exchanges; what is singular gives inf or NaN.
Eigen::VectorXd solve_square(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Eigen::MatrixXd solve_square(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a);

// With the lower half of l, diagonal included: l b, l^T b, l^-1 b.
Eigen::MatrixXd lower_times(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b);
Eigen::VectorXd lower_transposed_times(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);
Eigen::VectorXd lower_solve(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);
Eigen::MatrixXd lower_solve(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b);

// Adds to the lower half of `sum`: rows^T rows, and weight p p^T. The upper half stays.
void add_gram(Eigen::MatrixXd& sum, const Eigen::MatrixXd& rows);
void add_square(Eigen::MatrixXd& sum, const Eigen::VectorXd& p, double weight = 1.0);
Eigen::MatrixXd symmetric_of_lower(const Eigen::MatrixXd& lower);

// x that makes |a x - b| smallest, for each column of b: a has full column rank.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
// The same by singular values, as programs of 1991 did.
Eigen::VectorXd least_squares_by_singular_values(const Eigen::MatrixXd& a,
                                                 const Eigen::VectorXd& b);
// The shortest of the x that make |a x - b| smallest: a of any rank.
Eigen::MatrixXd shortest_least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace shaker::estimator
