#include "estimator/model/formula/formula_effect.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/model/formula/internal/expression.hpp"
#include "estimator/model/formula/internal/tape.hpp"

namespace shaker::estimator {
namespace {

using formula::Tape;
using GiNaC::ex;

constexpr double kUnbounded = 1e12;
constexpr int kMotion = 4;  // u, v, a, x

bool is_name(const std::string& text) {
  return !text.empty() && !std::isdigit(static_cast<unsigned char>(text[0])) &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

struct Equation {
  std::string place;  // in the model file, with its text
  ex terms;

  ex derivative(const ex& over, unsigned times = 1) const {
    const auto symbol = GiNaC::ex_to<GiNaC::symbol>(over);
    try {
      return terms.diff(symbol, times);
    } catch (const std::exception& error) {  // thrown by GiNaC: 0^v
      throw formula::FormulaError(fmt::format("{}: there is no derivative over {} ({})", place,
                                              symbol.get_name(), error.what()));
    }
  }
};

class FormulaEffect final : public Effect {
 public:
  explicit FormulaEffect(const config::EffectSpec& spec) : spec_(spec) {
    for (const auto& [symbol, given] : spec_.parameters)
      parameters_.push_back({symbol, given.unit, given.start.value_or(0.0),
                             given.lower.value_or(-kUnbounded), given.upper.value_or(kUnbounded),
                             "of the model file's own effect"});
    for (const auto& [symbol, value] : spec_.constants)
      constants_.push_back({symbol, "-", value, "of the model file's own effect"});
    for (const auto& [symbol, state] : spec_.states)
      internals_.push_back({symbol, "-", 1, state.start, "of the model file's own effect"});
    for (const auto& [symbol, lender] : spec_.borrows)
      borrows_.push_back({lender, symbol});
    if (parameters_.size() + borrows_.size() > kMostParameters ||
        internals_.size() > kMostInternals)
      throw formula::FormulaError(
          fmt::format("{} has too many parameters or states; at most {} and {}", spec_.effect,
                      kMostParameters, kMostInternals));
    compile();
  }

  std::string_view name() const override { return spec_.effect; }
  std::string_view formula() const override { return spec_.formula; }
  std::string_view meaning() const override { return "an effect of the model file's own"; }
  std::span<const ParameterInfo> parameters() const override { return parameters_; }
  std::span<const ConstantInfo> constants() const override { return constants_; }
  std::span<const InternalInfo> internals() const override { return internals_; }
  std::span<const Borrowed> borrows() const override { return borrows_; }
  bool sees_excitation() const override { return sees_excitation_; }
  bool has_velocity_kink() const override { return !kink_.zero(0); }

  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    const int w = static_cast<int>(internals_.size());
    const int p = static_cast<int>(parameters_.size() + borrows_.size());
    const double* in[kMotion + kMostInternals] = {at.u, at.v, at.a, at.x};
    for (int k = 0; k < w; ++k)
      in[kMotion + k] = at.w[k];
    double uniform[kMostUniform];
    std::copy_n(theta, p, uniform);
    std::copy_n(constants, constants_.size(), uniform + p);
    // Outputs for each equation: value, then derivatives over u, v, a, x, states, parameters.
    double* to[(1 + kMostInternals) * kWidest];
    char add[(1 + kMostInternals) * kWidest] = {1, 1, 1, 1};
    int next = 0;
    for (int row = 0; row < 1 + w; ++row) {
      const auto pick = [&](double* force, double* const* rows) {
        to[next++] = row == 0 ? force : rows == nullptr ? nullptr : rows[row - 1];
      };
      pick(out.f, out.h);
      pick(out.f_u, out.h_u);
      pick(out.f_v, out.h_v);
      pick(out.f_a, out.h_a);
      pick(sees_excitation_ ? out.f_x : nullptr, sees_excitation_ ? out.h_x : nullptr);
      for (int k = 0; k < w; ++k)
        to[next++] = row == 0 ? out.f_w[k] : out.h_w[(row - 1) * w + k];
      for (int k = 0; k < p; ++k)
        to[next++] = row == 0 ? out.f_theta[k] : out.h_theta[(row - 1) * p + k];
    }
    if (!tape_.evaluate(at.n, in, uniform, to, add)) return false;
    finish_rows(at, out);
    return true;
  }

  double velocity_kink(const double* theta, const double* constants, double u) const override {
    const std::size_t p = parameters_.size() + borrows_.size();
    double uniform[kMostUniform];
    std::copy_n(theta, p, uniform);
    std::copy_n(constants, constants_.size(), uniform + p);
    const double strokes[2] = {u, u}, sides[2] = {-1e-150, 1e-150};
    const double* in[kMotion + kMostInternals] = {strokes, sides};
    double second[2];
    double* to[] = {second};
    const char add[] = {0};
    return kink_.evaluate(2, in, uniform, to, add) ? second[1] - second[0] : 0.0;
  }

 private:
  static constexpr int kWidest = 1 + kMotion + kMostInternals + kMostParameters;
  static constexpr int kMostConstants = 16;
  static constexpr int kMostUniform = kMostParameters + kMostConstants;

  // The tape computes minus the rate; the row of a state is z' - rate.
  void finish_rows(const Points& at, const Forces& out) const {
    const std::size_t w = internals_.size();
    for (std::size_t r = 0; r < w; ++r) {
      for (int i = 0; i < at.n; ++i)
        out.h[r][i] += at.w_dot[r][i];
      std::fill_n(out.f_w_dot[r], at.n, 0.0);
      std::fill_n(out.f_w_ddot[r], at.n, 0.0);
      for (std::size_t k = 0; k < w; ++k) {
        std::fill_n(out.h_w_dot[r * w + k], at.n, r == k ? 1.0 : 0.0);
        std::fill_n(out.h_w_ddot[r * w + k], at.n, 0.0);
      }
    }
  }

  void compile() {
    const formula::FormulaLock lock;
    formula::Names names;
    std::vector<ex> varying, uniform;
    const auto name = [&](const std::string& symbol, std::vector<ex>& list) {
      if (!is_name(symbol))
        throw formula::FormulaError(
            fmt::format("'{}' is not a name: letters, digits and _ are allowed", symbol));
      const GiNaC::realsymbol created(symbol);
      if (!names.emplace(symbol, created).second)
        throw formula::FormulaError(fmt::format("'{}' has two meanings in this effect", symbol));
      list.push_back(created);
    };
    for (const char* motion : {"u", "v", "a", "x"})
      name(motion, varying);
    for (const auto& entry : spec_.states)
      name(entry.first, varying);
    for (const auto& entry : spec_.parameters)
      name(entry.first, uniform);
    for (const auto& entry : spec_.borrows)
      name(entry.first, uniform);
    const std::size_t parameters = uniform.size();
    for (const auto& entry : spec_.constants)
      name(entry.first, uniform);
    if (spec_.constants.size() > static_cast<std::size_t>(kMostConstants))
      throw formula::FormulaError(fmt::format("at most {} constants are allowed", kMostConstants));

    std::vector<Equation> equations{
        {fmt::format("formula \"{}\"", spec_.formula), read("formula", spec_.formula, names)}};
    for (const auto& [symbol, state] : spec_.states)
      equations.push_back({fmt::format("rate of {} \"{}\"", symbol, state.rate),
                           -read("rate of " + symbol, state.rate, names)});
    std::vector<ex> outputs;
    for (const Equation& one : equations) {
      const ex& equation = one.terms;
      outputs.push_back(equation);
      for (const ex& symbol : varying)
        outputs.push_back(one.derivative(symbol));
      for (std::size_t k = 0; k < parameters; ++k)
        outputs.push_back(one.derivative(uniform[k]));
      sees_excitation_ = sees_excitation_ || equation.has(varying[3]);
    }
    tape_.compile(varying, uniform, outputs);
    const bool kinked =
        spec_.states.empty() && equations[0].terms.has(formula::absolute(varying[1]));
    kink_.compile(varying, uniform, {kinked ? equations[0].derivative(varying[1], 2) : ex(0)});
  }

  static ex read(const std::string& what, const std::string& text, const formula::Names& names) {
    try {
      return formula::parse(text, names);
    } catch (const formula::FormulaError& error) {
      throw formula::FormulaError(fmt::format("{} \"{}\": {}", what, text, error.what()));
    }
  }

  config::EffectSpec spec_;  // owns the strings that the other members refer to
  std::vector<ParameterInfo> parameters_;
  std::vector<ConstantInfo> constants_;
  std::vector<InternalInfo> internals_;
  std::vector<Borrowed> borrows_;
  bool sees_excitation_ = false;
  Tape tape_, kink_;
};

}  // namespace

std::shared_ptr<const Effect> make_formula_effect(const config::EffectSpec& spec) {
  return std::make_shared<FormulaEffect>(spec);
}

}  // namespace shaker::estimator
