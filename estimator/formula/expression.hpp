// A formula of a model file as a symbolic expression (GiNaC), so that its partial derivatives are
// exact. Private to the formula's sources.
//
// GiNaC's own parser does not say where it stumbled, hence ours; GiNaC's expressions are shared
// between threads without locks, so all work with them goes under one lock (FormulaLock) and
// nothing of them outlives it: what is kept is a Tape.
#pragma once

#include <ginac/ginac.h>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>

namespace shaker::estimator::formula {

struct FormulaError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

// Hold one while any GiNaC expression lives.
class FormulaLock {
 public:
  FormulaLock();

 private:
  std::unique_lock<std::mutex> lock_;
};

using Names = std::map<std::string, GiNaC::ex>;

// Throws FormulaError with the column (from 1), what stands there and what is allowed.
//   numbers, names, + - * / ^ ( ), and functions of kFunctions
GiNaC::ex parse(const std::string& text, const Names& names);

// |x| and its slope, the sign (0 at 0), which stay as they are where GiNaC's abs would divide 0 by
// 0.
GiNaC::ex absolute(const GiNaC::ex& x);
GiNaC::ex direction(const GiNaC::ex& x);

inline constexpr const char* kAllowed =
    "numbers, + - * / ^ ( ), abs, sign, sqrt, exp, log, sin, cos, tanh, atan, smooth_abs(x, e), "
    "step(x, w), ramp(x, w)";

}  // namespace shaker::estimator::formula
