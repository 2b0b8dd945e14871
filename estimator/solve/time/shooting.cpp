#include "estimator/solve/time/shooting.hpp"

#include <algorithm>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {
namespace {

// after = e before, with e's own columns of the parameters; `wide` = columns + 1.
SHAKER_SIMD_CLONES void carry(std::size_t m, std::size_t k, const double* __restrict e,
                              const double* __restrict before, double* __restrict after) {
  const std::size_t wide = k + 1;
  for (std::size_t i = 0; i < m; ++i) {
    double* to = after + i * wide;
    for (std::size_t c = 0; c < wide; ++c)
      to[c] = c >= m && c < k ? e[i * k + c] : 0.0;
    for (std::size_t j = 0; j < m; ++j) {
      const double factor = e[i * k + j];
      for (std::size_t c = 0; c < wide; ++c)
        to[c] += factor * before[j * wide + c];
    }
  }
}

// total += c^T p c, where c is `move` in the rows of the states and the identity in the others.
SHAKER_SIMD_CLONES void add_condensed(std::size_t m, std::size_t k, const double* __restrict p,
                                      const double* __restrict move, double* __restrict half,
                                      double* __restrict total) {
  const std::size_t wide = k + 1;
  for (std::size_t r = 0; r < wide; ++r) {
    double* to = half + r * wide;
    for (std::size_t c = 0; c < wide; ++c)
      to[c] = c >= m ? p[r * wide + c] : 0.0;
    for (std::size_t j = 0; j < m; ++j) {
      const double factor = p[r * wide + j];
      for (std::size_t c = 0; c < wide; ++c)
        to[c] += factor * move[j * wide + c];
    }
  }
  for (std::size_t r = 0; r < wide; ++r) {
    double* to = total + r * wide;
    for (std::size_t j = 0; j < m; ++j) {
      const double factor = move[j * wide + r];
      for (std::size_t c = 0; c < wide; ++c)
        to[c] += factor * half[j * wide + c];
    }
    for (std::size_t c = 0; r >= m && c < wide; ++c)
      to[c] += half[r * wide + c];
  }
}

}  // namespace

void Shooting::condense(std::span<const Arc> arcs, std::span<const ArcEnd> ends, double closing) {
  const std::size_t wide = k_ + 1, size = m_ * wide, count = arcs.size();
  moves_.resize(count * size);
  gaps_.resize((count - 1) * m_);
  std::fill_n(moves_.begin(), size, 0.0);
  for (std::size_t j = 0; j < m_; ++j)
    moves_[j * wide + j] = 1.0;
  for (std::size_t a = 0; a + 1 < count; ++a) {
    double* next = &moves_[(a + 1) * size];
    carry(m_, k_, ends[a].derivatives, &moves_[a * size], next);
    for (std::size_t j = 0; j < m_; ++j) {
      const double gap = ends[a].state[j] - arcs[a + 1].start[j];
      gaps_[a * m_ + j] = gap;
      next[j * wide + k_] -= closing * gap;
    }
  }
}

Shooting::Rows Shooting::moves() const {
  return {moves_.data(), static_cast<Eigen::Index>(arcs() * m_), static_cast<Eigen::Index>(k_ + 1)};
}

Eigen::RowVectorXd Shooting::row(std::size_t arc, const double* own) const {
  const auto m = static_cast<Eigen::Index>(m_), parameters = static_cast<Eigen::Index>(k_ - m_);
  Eigen::RowVectorXd total = Eigen::Map<const Eigen::RowVectorXd>(own, m) *
                             moves().middleRows(static_cast<Eigen::Index>(arc) * m, m);
  total.segment(m, parameters) += Eigen::Map<const Eigen::RowVectorXd>(own + m_, parameters);
  return total;
}

void Shooting::add_products(const ArcSums& sums, std::size_t first,
                            std::vector<double>& total) const {
  std::vector<double> half((k_ + 1) * (k_ + 1));
  for (std::size_t a = 0; a < arcs(); ++a)
    add_condensed(m_, k_, sums.products(first + a), &moves_[a * m_ * (k_ + 1)], half.data(),
                  total.data());
}

void move_starts(std::span<Arc> arcs, const Eigen::VectorXd& moves) {
  const double* move = moves.data();
  for (Arc& arc : arcs) {
    for (double& state : arc.start)
      state += *move++;
  }
}

}  // namespace shaker::estimator
