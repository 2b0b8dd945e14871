#include "estimator/model/formula/internal/expression.hpp"

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

// GiNaC's macros declare functions in an older style than ours.
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wpedantic"
#if defined(__clang__)
#pragma GCC diagnostic ignored "-Wunused-const-variable"
#endif

#if defined(__SANITIZE_ADDRESS__)
// CLN, GiNaC's number library, keeps a few bytes until the program ends.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libcln";
}
#endif

namespace shaker::estimator::formula {
namespace {

DECLARE_FUNCTION_1P(shaker_abs)
DECLARE_FUNCTION_1P(shaker_sign)

GiNaC::ex abs_slope(const GiNaC::ex& x, unsigned) {
  return shaker_sign(x);
}
GiNaC::ex sign_slope(const GiNaC::ex&, unsigned) {
  return 0;
}

unsigned shaker_abs_SERIAL::serial = GiNaC::function::register_new(
    GiNaC::function_options("shaker_abs", 1).derivative_func(abs_slope));
unsigned shaker_sign_SERIAL::serial = GiNaC::function::register_new(
    GiNaC::function_options("shaker_sign", 1).derivative_func(sign_slope));

constexpr std::size_t kLongest = 2000;
constexpr double kLargestExponent = 1e9;  // of a variable: GiNaC throws for larger ones, and leaks
constexpr int kDeepest = 60;

std::mutex& the_mutex() {
  static std::mutex mutex;
  return mutex;
}

GiNaC::ex smooth_ramp(const GiNaC::ex& x, const GiNaC::ex& w) {
  const GiNaC::ex size = absolute(x);
  return (x + size) / 2 + w * GiNaC::log(1 + GiNaC::exp(-size / w));
}

// Recursive-descent parser. Powers associate to the right and bind before a sign: -v^2
// is -(v^2).
class Parser {
 public:
  Parser(const std::string& text, const Names& names) : text_(text), names_(names) {}

  GiNaC::ex whole() {
    if (text_.size() > kLongest)
      throw FormulaError(fmt::format("the formula has {} characters; at most {} are allowed",
                                     text_.size(), kLongest));
    const GiNaC::ex result = sum();
    if (at_ < text_.size()) complain("an operator or the end of the formula");
    return result;
  }

 private:
  [[noreturn]] void complain(const std::string& wanted) const {
    const std::string found =
        at_ < text_.size() ? fmt::format("'{}'", text_[at_]) : std::string("the end");
    throw FormulaError(fmt::format("column {}: {} stands where {} is expected; allowed are {}",
                                   at_ + 1, found, wanted, kAllowed));
  }
  char next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])))
      ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool take(char c) {
    if (next() != c) return false;
    ++at_;
    next();
    return true;
  }

  GiNaC::ex sum() {
    if (++depth_ > kDeepest)
      throw FormulaError(fmt::format("column {}: parentheses are nested too deep", at_ + 1));
    GiNaC::ex value = product();
    for (;;) {
      if (take('+'))
        value += product();
      else if (take('-'))
        value -= product();
      else
        break;
    }
    --depth_;
    return value;
  }

  GiNaC::ex product() {
    GiNaC::ex value = signed_power();
    for (;;) {
      if (take('*')) {
        value *= signed_power();
      } else if (take('/')) {
        const std::size_t column = at_ + 1;
        const GiNaC::ex divisor = signed_power();
        if (divisor.is_zero())
          throw FormulaError(fmt::format("column {}: this divides by zero", column));
        value /= divisor;
      } else {
        return value;
      }
    }
  }

  GiNaC::ex signed_power() {
    bool negative = false;
    for (;;) {
      if (take('-'))
        negative = !negative;
      else if (!take('+'))
        break;
    }
    const GiNaC::ex value = power();
    return negative ? -value : value;
  }

  GiNaC::ex power() {
    const std::size_t column = at_ + 1;
    const GiNaC::ex base = primary();
    if (!take('^')) return base;
    if (++depth_ > kDeepest)
      throw FormulaError(fmt::format("column {}: powers are nested too deep", at_ + 1));
    const GiNaC::ex exponent = signed_power();
    --depth_;
    if (!GiNaC::is_a<GiNaC::numeric>(exponent)) {
      if (base.is_zero())
        throw FormulaError(fmt::format("column {}: this is a power of zero", column));
      return GiNaC::pow(base, exponent);
    }
    if (!GiNaC::is_a<GiNaC::numeric>(base)) {
      if (!(std::fabs(GiNaC::ex_to<GiNaC::numeric>(exponent).to_double()) < kLargestExponent))
        throw FormulaError(fmt::format("column {}: the exponent is too large", column));
      return GiNaC::pow(base, exponent);
    }
    const double number = std::pow(GiNaC::ex_to<GiNaC::numeric>(base).to_double(),
                                   GiNaC::ex_to<GiNaC::numeric>(exponent).to_double());
    if (!std::isfinite(number))
      throw FormulaError(fmt::format("column {}: this power is not a finite number", column));
    return GiNaC::numeric(number);
  }

  GiNaC::ex primary() {
    const char c = next();
    if (take('(')) {
      const GiNaC::ex value = sum();
      if (!take(')')) complain("')'");
      return value;
    }
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') return number();
    if (std::isalpha(static_cast<unsigned char>(c)) || c == '_') return name();
    complain("a number, a name or '('");
  }

  GiNaC::ex number() {
    const char* begin = text_.c_str() + at_;
    char* end = nullptr;
    const double value = std::strtod(begin, &end);
    if (end == begin || !std::isfinite(value)) complain("a number");
    at_ += static_cast<std::size_t>(end - begin);
    next();
    // Whole numbers stay exact, so that the derivatives of powers stay simple.
    if (value == std::floor(value) && std::fabs(value) < 1e6)
      return GiNaC::numeric(static_cast<long>(value));
    return GiNaC::numeric(value);
  }

  GiNaC::ex name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_'))
      ++at_;
    const std::string word = text_.substr(begin, at_ - begin);
    if (take('(')) return call(word, begin);
    const auto found = names_.find(word);
    if (found != names_.end()) return found->second;
    std::vector<std::string> known;
    for (const auto& entry : names_)
      known.push_back(entry.first);
    throw FormulaError(fmt::format("column {}: '{}' is not known; this effect has {}", begin + 1,
                                   word, fmt::join(known, ", ")));
  }

  GiNaC::ex call(const std::string& word, std::size_t begin) {
    std::vector<GiNaC::ex> x;
    do
      x.push_back(sum());
    while (take(','));
    if (!take(')')) complain("',' or ')'");
    if (x.size() == 1) {
      if (word == "abs") return absolute(x[0]);
      if (word == "sign") return direction(x[0]);
      if (word == "sqrt") return GiNaC::sqrt(x[0]);
      if (word == "exp") return GiNaC::exp(x[0]);
      if (word == "log") return GiNaC::log(x[0]);
      if (word == "sin") return GiNaC::sin(x[0]);
      if (word == "cos") return GiNaC::cos(x[0]);
      if (word == "tanh") return GiNaC::tanh(x[0]);
      if (word == "atan") return GiNaC::atan(x[0]);
    } else if (x.size() == 2) {
      if (word == "smooth_abs") return GiNaC::sqrt(x[0] * x[0] + x[1] * x[1]);
      if (word == "step") return (1 + GiNaC::tanh(x[0] / (2 * x[1]))) / 2;
      if (word == "ramp") return smooth_ramp(x[0], x[1]);
    }
    throw FormulaError(
        fmt::format("column {}: there is no function {} of {} argument(s); allowed "
                    "are {}",
                    begin + 1, word, x.size(), kAllowed));
  }

  const std::string& text_;
  const Names& names_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

FormulaLock::FormulaLock() : lock_(the_mutex()) {}

GiNaC::ex absolute(const GiNaC::ex& x) {
  return shaker_abs(x);
}
GiNaC::ex direction(const GiNaC::ex& x) {
  return shaker_sign(x);
}

GiNaC::ex parse(const std::string& text, const Names& names) {
  try {
    return Parser(text, names).whole();
  } catch (const FormulaError&) {
    throw;
  } catch (const std::exception& error) {  // thrown by GiNaC: 0^-1, log(0)
    throw FormulaError(fmt::format("this formula has no value: {}", error.what()));
  }
}

}  // namespace shaker::estimator::formula
