#include "tests/estimator/paper/optimisers/nist_models.hpp"

#include <boost/math/constants/constants.hpp>

namespace shaker::estimator::optimisers::testing {
namespace {

template <class X>
X pi() {
  return boost::math::constants::pi<X>();
}
template <class B>
B square(const B& b) {
  return b * b;
}

#define SHAKER_NIST_MODEL(NAME, COUNT, ...)           \
  struct NAME {                                       \
    static constexpr std::size_t kParameters = COUNT; \
    template <class B, class X>                       \
    B operator()(const B* b, const X* x) const {      \
      return __VA_ARGS__;                             \
    }                                                 \
  };
SHAKER_NIST_MODEL(Bennett5, 3, b[0] * pow(b[1] + x[0], -(B(X(1)) / b[2])))
SHAKER_NIST_MODEL(BoxBOD, 2, b[0] * (X(1) - exp(-(b[1] * x[0]))))
SHAKER_NIST_MODEL(Chwirut, 3, exp(-(b[0] * x[0])) / (b[1] + b[2] * x[0]))
SHAKER_NIST_MODEL(DanWood, 2, b[0] * pow(B(x[0]), b[1]))
SHAKER_NIST_MODEL(Eckerle4, 3, b[0] / b[1] * exp(X(-0.5) * square((x[0] - b[2]) / b[1])))
SHAKER_NIST_MODEL(Gauss, 8,
                  b[0] * exp(-(b[1] * x[0])) + b[2] * exp(-square((x[0] - b[3]) / b[4])) +
                      b[5] * exp(-square((x[0] - b[6]) / b[7])))
SHAKER_NIST_MODEL(Hahn1, 7,
                  (b[0] + x[0] * (b[1] + x[0] * (b[2] + x[0] * b[3]))) /
                      (X(1) + x[0] * (b[4] + x[0] * (b[5] + x[0] * b[6]))))
SHAKER_NIST_MODEL(Kirby2, 5,
                  (b[0] + x[0] * (b[1] + x[0] * b[2])) / (X(1) + x[0] * (b[3] + x[0] * b[4])))
SHAKER_NIST_MODEL(Lanczos, 6,
                  b[0] * exp(-(b[1] * x[0])) + b[2] * exp(-(b[3] * x[0])) +
                      b[4] * exp(-(b[5] * x[0])))
SHAKER_NIST_MODEL(MGH09, 4, b[0] * (x[0] * x[0] + x[0] * b[1]) / (x[0] * x[0] + x[0] * b[2] + b[3]))
SHAKER_NIST_MODEL(MGH10, 3, b[0] * exp(b[1] / (x[0] + b[2])))
SHAKER_NIST_MODEL(MGH17, 5, b[0] + b[1] * exp(-(x[0] * b[3])) + b[2] * exp(-(x[0] * b[4])))
SHAKER_NIST_MODEL(Misra1b, 2, b[0] * (X(1) - inverse(square(X(1) + b[1] * X(x[0] / 2)))))
SHAKER_NIST_MODEL(Misra1c, 2, b[0] * (X(1) - pow(X(1) + X(2) * b[1] * x[0], B(X(-0.5)))))
SHAKER_NIST_MODEL(Misra1d, 2, b[0] * b[1] * x[0] / (X(1) + b[1] * x[0]))
SHAKER_NIST_MODEL(Nelson, 3, b[0] - b[1] * x[0] * exp(-(b[2] * x[1])))
SHAKER_NIST_MODEL(Rat42, 3, b[0] / (X(1) + exp(b[1] - b[2] * x[0])))
SHAKER_NIST_MODEL(Rat43, 4, b[0] / pow(X(1) + exp(b[1] - b[2] * x[0]), B(X(1)) / b[3]))
SHAKER_NIST_MODEL(Roszman1, 4, b[0] - b[1] * x[0] - atan(b[2] / (x[0] - b[3])) / pi<X>())
#undef SHAKER_NIST_MODEL

struct Enso {
  static constexpr std::size_t kParameters = 9;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    using std::cos;
    using std::sin;
    const X circle = X(2) * pi<X>() * x[0];
    const X year = circle / 12;
    return b[0] + b[1] * X(cos(year)) + b[2] * X(sin(year)) + b[4] * cos(circle / b[3]) +
           b[5] * sin(circle / b[3]) + b[7] * cos(circle / b[6]) + b[8] * sin(circle / b[6]);
  }
};

template <class Formula>
std::unique_ptr<LeastSquaresProblem> make(const FormulaData& data) {
  return std::make_unique<FormulaProblem<Formula>>(data);
}

struct Entry {
  const char* name;
  std::unique_ptr<LeastSquaresProblem> (*make)(const FormulaData&);
};
constexpr Entry kModels[] = {
    {"Bennett5", make<Bennett5>}, {"BoxBOD", make<BoxBOD>},     {"Chwirut1", make<Chwirut>},
    {"Chwirut2", make<Chwirut>},  {"DanWood", make<DanWood>},   {"ENSO", make<Enso>},
    {"Eckerle4", make<Eckerle4>}, {"Gauss1", make<Gauss>},      {"Gauss2", make<Gauss>},
    {"Gauss3", make<Gauss>},      {"Hahn1", make<Hahn1>},       {"Kirby2", make<Kirby2>},
    {"Lanczos1", make<Lanczos>},  {"Lanczos2", make<Lanczos>},  {"Lanczos3", make<Lanczos>},
    {"MGH09", make<MGH09>},       {"MGH10", make<MGH10>},       {"MGH17", make<MGH17>},
    {"Misra1a", make<BoxBOD>},    {"Misra1b", make<Misra1b>},   {"Misra1c", make<Misra1c>},
    {"Misra1d", make<Misra1d>},   {"Nelson", make<Nelson>},     {"Rat42", make<Rat42>},
    {"Rat43", make<Rat43>},       {"Roszman1", make<Roszman1>}, {"Thurber", make<Hahn1>},
};

}  // namespace

std::unique_ptr<LeastSquaresProblem> nist_problem(const NistSet& set) {
  FormulaData data = set.data;
  if (set.name == "Nelson") {  // the response is the logarithm
    for (Extended& y : data.y)
      y = log(y);
  }
  for (const Entry& entry : kModels) {
    if (set.name == entry.name) return entry.make(data);
  }
  return nullptr;
}

}  // namespace shaker::estimator::optimisers::testing
