// Compiles symbolic expressions to a tape.
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "estimator/model/formula/internal/expression.hpp"
#include "estimator/model/formula/internal/tape.hpp"

namespace shaker::estimator::formula {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_a;

class Compiler {
 public:
  explicit Compiler(Tape& tape) : tape_(tape) {}

  void input(const ex& symbol, bool varying) { known_[symbol] = {fresh(), varying}; }

  int of(const ex& e) { return value(e).at; }

 private:
  struct Value {
    int at;
    bool varying;
  };

  int fresh() {
    if (tape_.registers_ >= Tape::kMostRegisters)
      throw FormulaError(fmt::format(
          "the formula with its derivatives needs more than {} operations; make it shorter",
          Tape::kMostRegisters));
    return tape_.registers_++;
  }

  Value constant(double number) {
    const int at = fresh();
    tape_.constants_.push_back({at, number});
    return {at, false};
  }

  Value emit(Tape::Op op, Value a, Value b) {
    const Value result{fresh(), a.varying || b.varying};
    (result.varying ? tape_.each_ : tape_.once_)
        .push_back({op, static_cast<std::int16_t>(result.at), static_cast<std::int16_t>(a.at),
                    static_cast<std::int16_t>(b.at)});
    return result;
  }
  Value emit(Tape::Op op, Value a) { return emit(op, a, a); }

  Value value(const ex& e) {
    const auto found = known_.find(e);
    if (found != known_.end()) return found->second;
    const Value result = compute(e);
    known_[e] = result;
    return result;
  }

  Value compute(const ex& e) {
    if (is_a<GiNaC::numeric>(e)) return constant(ex_to<GiNaC::numeric>(e).to_double());
    if (is_a<GiNaC::add>(e)) return sum(e);
    if (is_a<GiNaC::mul>(e)) return product(e);
    if (is_a<GiNaC::power>(e)) return power(e.op(0), e.op(1));
    if (is_a<GiNaC::function>(e)) {
      static const std::map<std::string, Tape::Op> operations = {
          {"exp", Tape::Op::exp},        {"log", Tape::Op::log},         {"tanh", Tape::Op::tanh},
          {"sin", Tape::Op::sin},        {"cos", Tape::Op::cos},         {"atan", Tape::Op::atan},
          {"shaker_abs", Tape::Op::abs}, {"shaker_sign", Tape::Op::sign}};
      const auto operation = operations.find(ex_to<GiNaC::function>(e).get_name());
      if (operation != operations.end()) return emit(operation->second, value(e.op(0)));
    }
    if (is_a<GiNaC::constant>(e)) return constant(ex_to<GiNaC::numeric>(e.evalf()).to_double());
    throw FormulaError("the formula has a derivative that cannot be computed in real numbers");
  }

  // Sums the uniform terms separately, so that they are computed once per call. Negative terms
  // are subtracted.
  Value sum(const ex& e) {
    Value totals[2] = {{-1, false}, {-1, false}};  // uniform, varying
    for (std::size_t k = 0; k < e.nops(); ++k) {
      const ex term = e.op(k);
      const bool minus = is_a<GiNaC::mul>(term) && is_a<GiNaC::numeric>(term.op(term.nops() - 1)) &&
                         term.op(term.nops() - 1).is_equal(-1);
      const Value part = value(minus ? -term : term);
      Value& total = totals[part.varying ? 1 : 0];
      if (total.at < 0)
        total = minus ? emit(Tape::Op::subtract, value(ex(0)), part) : part;
      else
        total = emit(minus ? Tape::Op::subtract : Tape::Op::add, total, part);
    }
    if (totals[0].at < 0 || totals[1].at < 0) return totals[totals[0].at < 0 ? 1 : 0];
    return emit(Tape::Op::add, totals[0], totals[1]);
  }

  Value product(const ex& e) {
    Value totals[2] = {{-1, false}, {-1, false}};
    for (std::size_t k = 0; k < e.nops(); ++k) {
      const Value part = value(e.op(k));
      Value& total = totals[part.varying ? 1 : 0];
      total = total.at < 0 ? part : emit(Tape::Op::multiply, total, part);
    }
    if (totals[0].at < 0 || totals[1].at < 0) return totals[totals[0].at < 0 ? 1 : 0];
    return emit(Tape::Op::multiply, totals[0], totals[1]);
  }

  Value power(const ex& base, const ex& exponent) {
    if (is_a<GiNaC::numeric>(exponent)) {
      const double number = ex_to<GiNaC::numeric>(exponent).to_double();
      if (number < 0.0) return emit(Tape::Op::reciprocal, value(GiNaC::pow(base, -exponent)));
      if (number == std::floor(number) && number <= 64.0)
        return whole_power(value(base), static_cast<int>(number));
      if (number == 0.5) return emit(Tape::Op::sqrt, value(base));
    }
    // In a derivative, base^(e + n) then shares base^e with the function itself.
    if (is_a<GiNaC::add>(exponent)) {
      const ex last = exponent.op(exponent.nops() - 1);
      if (is_a<GiNaC::numeric>(last) && ex_to<GiNaC::numeric>(last).is_integer())
        return emit(Tape::Op::multiply, value(GiNaC::pow(base, exponent - last)),
                    value(GiNaC::pow(base, last)));
    }
    return emit(Tape::Op::exp, emit(Tape::Op::multiply, value(exponent), value(GiNaC::log(base))));
  }

  Value whole_power(Value base, int exponent) {
    if (exponent == 0) return constant(1.0);
    if (exponent == 1) return base;
    const Value half = whole_power(base, exponent / 2);
    const Value square = emit(Tape::Op::multiply, half, half);
    return exponent % 2 == 0 ? square : emit(Tape::Op::multiply, square, base);
  }

  Tape& tape_;
  std::map<ex, Value, GiNaC::ex_is_less> known_;
};

void Tape::compile(const std::vector<ex>& varying, const std::vector<ex>& uniform,
                   const std::vector<ex>& outputs) {
  varying_inputs_ = static_cast<int>(varying.size());
  uniform_inputs_ = static_cast<int>(uniform.size());
  Compiler compiler(*this);
  for (const ex& symbol : varying)
    compiler.input(symbol, true);
  for (const ex& symbol : uniform)
    compiler.input(symbol, false);
  for (const ex& output : outputs)
    outputs_.push_back(output.is_zero() ? -1 : compiler.of(output));
}

}  // namespace shaker::estimator::formula
