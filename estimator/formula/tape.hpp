// A set of expressions compiled to one list of vector instructions, evaluated for blocks of points
// at once. Common subexpressions are computed once, and what depends on parameters only once a
// call.
#pragma once

#include <cstdint>
#include <vector>

namespace GiNaC {
class ex;
}

namespace shaker::estimator::formula {

// Immutable after compilation; evaluation uses the stack only.
class Tape {
 public:
  static constexpr int kBlock = 32;
  static constexpr int kMostRegisters = 480;

  // `varying` inputs have an array each, `uniform` ones a number. Throws FormulaError when the
  // expressions need too many operations. Holding a FormulaLock is the caller's.
  void compile(const std::vector<GiNaC::ex>& varying, const std::vector<GiNaC::ex>& uniform,
               const std::vector<GiNaC::ex>& outputs);

  int outputs() const { return static_cast<int>(outputs_.size()); }
  // Whether an output is a constant 0.
  bool zero(int output) const { return outputs_[static_cast<std::size_t>(output)] < 0; }

  // n points. out[k] is null or gets output k; `add[k]` non-zero: added to what is there. False
  // when some output is not finite (a logarithm of a negative number, a division by zero).
  bool evaluate(int n, const double* const* varying, const double* uniform, double* const* out,
                const char* add) const;

  enum class Op : std::uint8_t {
    add,
    subtract,
    multiply,
    reciprocal,
    sqrt,
    exp,
    log,
    tanh,
    sin,
    cos,
    atan,
    abs,
    sign
  };
  struct Instruction {
    Op op;
    std::int16_t to, a, b;
  };

 private:
  friend class Compiler;
  struct Constant {
    int at;
    double value;
  };
  int varying_inputs_ = 0, uniform_inputs_ = 0, registers_ = 0;
  std::vector<Constant> constants_;
  std::vector<Instruction> once_, each_;
  std::vector<int> outputs_;  // registers; -1 for 0
};

}  // namespace shaker::estimator::formula
