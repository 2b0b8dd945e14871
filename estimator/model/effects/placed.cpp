#include "estimator/model/effects/placed.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace shaker::estimator {
namespace {

constexpr int kPlacedBlock = 64;   // points at a time
constexpr double kFarthest = 1e6;  // m: a bound of a place that the model file does not bound

class Placed final : public Effect {
 public:
  explicit Placed(const Effect& about) : about_(about) {
    const auto known = about.parameters();
    parameters_.assign(known.begin(), known.end());
    const ConstantInfo& place = about.constants().front();
    parameters_.push_back(
        {place.symbol, place.unit, place.value, -kFarthest, kFarthest, place.meaning});
  }

  std::string_view name() const override { return about_.name(); }
  std::string_view formula() const override { return about_.formula(); }
  std::string_view meaning() const override { return about_.meaning(); }
  std::span<const ParameterInfo> parameters() const override { return parameters_; }
  bool carries_load() const override { return about_.carries_load(); }
  bool moves_base() const override { return about_.moves_base(); }

  bool evaluate(const Points& at, const double* theta, const double* /*constants*/,
                const Forces& out) const override {
    const std::size_t place = parameters_.size() - 1;
    for (int begin = 0; begin < at.n; begin += kPlacedBlock) {
      Points part;
      part.n = std::min(kPlacedBlock, at.n - begin);
      part.u = at.u + begin;
      part.v = at.v + begin;
      part.a = at.a + begin;
      alignas(64) std::array<double, kPlacedBlock> f_u{};
      std::array<double*, kMostParameters> columns{};
      for (std::size_t k = 0; k < place; ++k)
        columns[k] = out.f_theta[k] + begin;
      Forces own;
      own.f = out.f + begin;
      own.f_u = f_u.data();
      own.f_v = out.f_v + begin;
      own.f_a = out.f_a + begin;
      own.f_theta = columns.data();
      if (!about_.evaluate(part, theta, theta + place, own)) return false;
      for (int i = 0; i < part.n; ++i) {
        out.f_u[begin + i] += f_u[static_cast<std::size_t>(i)];
        out.f_theta[place][begin + i] = -f_u[static_cast<std::size_t>(i)];
      }
    }
    return true;
  }

 private:
  const Effect& about_;
  std::vector<ParameterInfo> parameters_;
};

}  // namespace

bool has_place(const Effect& effect) {
  const auto constants = effect.constants();
  return constants.size() == 1 && constants.front().symbol == kPlace;
}

std::shared_ptr<const Effect> make_placed(const Effect& about) {
  return std::make_shared<Placed>(about);
}

}  // namespace shaker::estimator
