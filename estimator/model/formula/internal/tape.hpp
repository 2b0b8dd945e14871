// A set of expressions, compiled to a list of vector instructions that evaluates blocks of
// points. Common subexpressions are computed once; those that depend on parameters only, once
// per call.
#pragma once

#include <cstdint>
#include <vector>

namespace GiNaC {
class ex;
}

namespace shaker::estimator::formula {

// Immutable after compilation. Evaluation does not allocate; it uses about 120 kB of stack.
class Tape {
 public:
  static constexpr int kBlock = 32;
  static constexpr int kMostRegisters = 480;

  // `varying` inputs have one array each, `uniform` inputs one number. The caller holds a
  // FormulaLock. Throws FormulaError if the expressions need too many operations.
  void compile(const std::vector<GiNaC::ex>& varying, const std::vector<GiNaC::ex>& uniform,
               const std::vector<GiNaC::ex>& outputs);

  int outputs() const { return static_cast<int>(outputs_.size()); }
  // True if an output is the constant 0.
  bool zero(int output) const { return outputs_[static_cast<std::size_t>(output)] < 0; }

  // Evaluates n points. out[k] receives output k; null skips it. add[k] non-zero adds to the
  // values there. A null `varying` array counts as 0. Returns false if an output that is not
  // skipped is not finite (logarithm of a negative number, division by zero).
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
