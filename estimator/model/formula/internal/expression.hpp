// A formula of a model file as a symbolic expression (GiNaC), so that its partial derivatives
// are exact. Private to the sources of the formula.
//
// A parser of our own reports the column of an error, which GiNaC's parser does not. GiNaC's
// expressions share data between threads without locks. All work with them therefore holds one
// global lock (FormulaLock), and no expression outlives it; only a Tape is kept.
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

// Holds the global lock, while any GiNaC expression lives. Other threads must wait.
class FormulaLock {
 public:
  FormulaLock();

 private:
  std::unique_lock<std::mutex> lock_;
};

using Names = std::map<std::string, GiNaC::ex>;

// Parses a formula: numbers, names, + - * / ^ ( ), and the functions in kAllowed. Throws
// FormulaError that states the column (from 1), what is there and what is allowed.
GiNaC::ex parse(const std::string& text, const Names& names);

// |x| and its derivative, the sign (0 at 0). They remain functions of their own, where GiNaC's
// abs would give 0 / 0.
GiNaC::ex absolute(const GiNaC::ex& x);
GiNaC::ex direction(const GiNaC::ex& x);

inline constexpr const char* kAllowed =
    "numbers, + - * / ^ ( ), abs, sign, sqrt, exp, log, sin, cos, tanh, atan, smooth_abs(x, e), "
    "step(x, w), ramp(x, w)";

}  // namespace shaker::estimator::formula
