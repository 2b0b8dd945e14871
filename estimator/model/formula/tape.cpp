// The interpreter of a tape: each instruction is one loop over a block of points.
#include "estimator/model/formula/internal/tape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/numbers.hpp"
#include "estimator/math/simd_math.hpp"

namespace shaker::estimator::formula {
namespace {

constexpr int kBlock = Tape::kBlock;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

SHAKER_INLINE double exponential(double x) {
  const double inside = x > 700.0 ? 700.0 : x < -700.0 ? -700.0 : x;
  const double e = fast_exp(inside);
  return x > 700.0 ? kInfinity : x == x ? e : kNaN;
}

SHAKER_INLINE double logarithm(double x) {
  const bool positive = x > 1e-300;
  const double value = fast_log(positive ? x : 1.0);
  return positive ? value : kNaN;
}

template <class F>
SHAKER_INLINE void fill(double* __restrict to, const F& of) {
  for (int i = 0; i < kBlock; ++i)
    to[i] = of(i);
}

SHAKER_SIMD_CLONES void run(const Tape::Instruction* code, int count, double* __restrict store) {
  using Op = Tape::Op;
  for (int k = 0; k < count; ++k) {
    const Tape::Instruction in = code[k];
    double* __restrict to = store + in.to * kBlock;
    const double* a = store + in.a * kBlock;
    const double* b = store + in.b * kBlock;
    switch (in.op) {
      case Op::add:
        fill(to, [=](int i) { return a[i] + b[i]; });
        break;
      case Op::subtract:
        fill(to, [=](int i) { return a[i] - b[i]; });
        break;
      case Op::multiply:
        fill(to, [=](int i) { return a[i] * b[i]; });
        break;
      case Op::reciprocal:
        fill(to, [=](int i) { return 1.0 / a[i]; });
        break;
      case Op::sqrt:
        fill(to, [=](int i) { return std::sqrt(a[i]); });
        break;
      case Op::exp:
        fill(to, [=](int i) { return exponential(a[i]); });
        break;
      case Op::log:
        fill(to, [=](int i) { return logarithm(a[i]); });
        break;
      case Op::tanh:
        fill(to, [=](int i) { return 1.0 - 2.0 / (exponential(2.0 * a[i]) + 1.0); });
        break;
      case Op::sin:
        fill(to, [=](int i) { return std::sin(a[i]); });
        break;
      case Op::cos:
        fill(to, [=](int i) { return std::cos(a[i]); });
        break;
      case Op::atan:
        fill(to, [=](int i) { return std::atan(a[i]); });
        break;
      case Op::abs:
        fill(to, [=](int i) { return std::fabs(a[i]); });
        break;
      case Op::sign:
        fill(to, [=](int i) { return a[i] > 0.0 ? 1.0 : a[i] < 0.0 ? -1.0 : 0.0; });
        break;
    }
  }
}

}  // namespace

bool Tape::evaluate(int n, const double* const* varying, const double* uniform, double* const* out,
                    const char* add) const {
  alignas(64) double store[kMostRegisters * kBlock];
  const auto at = [&](int k) { return store + k * kBlock; };
  for (int k = 0; k < uniform_inputs_; ++k)
    std::fill_n(at(varying_inputs_ + k), kBlock, uniform[k]);
  for (const Constant& constant : constants_)
    std::fill_n(at(constant.at), kBlock, constant.value);
  double wild = 0.0;  // becomes NaN if a value is not finite
  for (int first = 0; first < n; first += kBlock) {
    const int count = std::min(kBlock, n - first);
    for (int k = 0; k < varying_inputs_; ++k) {
      double* to = at(k);
      if (varying[k] == nullptr) {
        std::fill_n(to, kBlock, 0.0);
        continue;
      }
      std::copy_n(varying[k] + first, count, to);
      std::fill(to + count, to + kBlock, to[count - 1]);
    }
    if (first == 0) run(once_.data(), static_cast<int>(once_.size()), store);
    run(each_.data(), static_cast<int>(each_.size()), store);
    for (std::size_t k = 0; k < outputs_.size(); ++k) {
      if (out[k] == nullptr) continue;
      double* to = out[k] + first;
      if (outputs_[k] < 0) {
        if (!add[k]) std::fill_n(to, count, 0.0);
        continue;
      }
      const double* from = at(outputs_[k]);
      for (int i = 0; i < count; ++i)
        wild += from[i] * 0.0;
      for (int i = 0; i < count; ++i)
        to[i] = add[k] ? to[i] + from[i] : from[i];
    }
  }
  return wild == 0.0;
}

}  // namespace shaker::estimator::formula
