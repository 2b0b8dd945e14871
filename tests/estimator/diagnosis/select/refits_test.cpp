#include "estimator/diagnosis/select/internal/refits.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "estimator/diagnosis/select/internal/centring.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// The oleo fitted to a campaign of the virtual rig with a hidden effect.
class Hidden {
 public:
  explicit Hidden(const std::map<std::string, double>& truth, double noise = 5e-6,
                  std::uint64_t seed = 5) {
    const Campaign campaign = testing::recorded(
        truth, {{1.0, 3.0}, {2.0, 1.5}, {2.0, 4.0}, {4.0, 6.0}}, seed, "oleo", noise);
    std::vector<SteadyRun> runs;
    for (const Recording& recording : campaign.runs)
      runs.push_back(steady_cycles(recording).value());
    FitOptions far;
    far.from_rest = true;
    Weighed weighed = weigh(runs);
    HarmonicFit rough = fit_harmonics(estimator::testing::oleo(), weighed.data, {}, nullptr, far);
    weighed = weigh(runs, rough);
    data_ = std::move(weighed.data);
    base_.fit = std::make_shared<const HarmonicFit>(
        fit_harmonics(estimator::testing::oleo(), data_, rough.theta, nullptr, far));
    refits_ = std::make_unique<Refits>(*base_.fit, data_, options_);
  }
  const Hypothesis& base() const { return base_; }
  const Refits& refits() const { return *refits_; }
  Refits refits_of_gap() const { return {*base_.fit, data_, options_, Errors::residual}; }
  double observations() const { return base_.fit->observations; }

 private:
  const FitOptions options_;
  std::vector<RunDatum> data_;
  Hypothesis base_;
  std::unique_ptr<Refits> refits_;
};

Candidate candidate(const std::string& effect) {
  const MotionRange range{0.13, 0.17, 0.3, 10.0};
  std::vector<std::string> notes;
  const auto all = candidates(estimator::testing::oleo(), range, Kind::periodic, notes).tried;
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Candidate& c) { return c.effect->name() == effect; });
  EXPECT_NE(found, all.end()) << effect;
  return *found;
}

// With a wrong rest position the fit would leave a linear and a quadratic force to be
// explained.
TEST(Refits, FindsWhereASpringIsAtRest) {
  const Hidden hidden({{"cubic_stiffness", 3000.0}, {"cubic_stiffness_centre", 0.16}});
  const Candidate cubic = candidate("cubic_stiffness");
  // At zero, along the motion, and preloaded at zero.
  const double places[] = {0.0, 0.14, 0.15, 0.16, 0.166, -0.17};
  ASSERT_EQ(cubic.probes.size(), std::size(places));
  EXPECT_FALSE(cubic.probes[0].line.constants.contains("u0"));
  EXPECT_NEAR(cubic.probes[5].line.constants.at("u0"), places[5], 1e-12);
  for (const std::size_t p : {2U, 4U}) {
    EXPECT_NEAR(cubic.probes[p].line.constants.at("u0"), places[p], 1e-12);
    const Hypothesis found = hidden.refits().with(hidden.base(), cubic.probes[p]);
    EXPECT_LT(found.fit->chi_squared, 1.5 * hidden.observations());
    EXPECT_NEAR(found.fit->spec.effects.back().constants.at("u0"), 0.16, 5e-4);
    EXPECT_NEAR(found.fit->theta.back(), 3000.0, 150.0);
    EXPECT_THAT(fitted_places(found.fit->spec, 3), ::testing::ElementsAre(3U));
    EXPECT_TRUE(found.disqualified.empty()) << found.disqualified;
  }
}

TEST(Refits, BeginsElsewhereOnlyWhereThatClosesEnoughOfTheGap) {
  const Hidden hidden({{"metering_k1", 0.5}});
  const Candidate pin = candidate("metering_pin");
  const Probe& probe = pin.probes[pin.probes.size() / 2];
  const double before = hidden.base().fit->chi_squared;
  ASSERT_GT(before, 100.0 * hidden.observations());
  const auto found = hidden.refits().elsewhere(probe, 0.5 * before);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->effects, std::vector<std::string>{"metering_pin"});
  EXPECT_LT(found->fit->chi_squared, 1.5 * hidden.observations());
  EXPECT_TRUE(found->disqualified.empty()) << found->disqualified;
  EXPECT_FALSE(hidden.refits().elsewhere(probe, 0.1 * hidden.observations()));
}

// The residual of a smoothed friction is below the noise, but the friction parameter is still
// biased.
TEST(Refits, SharpensACornerThatLeavesNoMoreThanNoise) {
  const Hidden hidden({{"coulomb_friction", 0.1}}, 2e-5, 6);
  Hypothesis friction =
      hidden.refits().with(hidden.base(), candidate("coulomb_friction").probes.at(0));
  const double chi_squared = friction.fit->chi_squared;
  const double round = friction.fit->theta.back();
  ASSERT_LT(chi_squared, hidden.observations());
  ASSERT_TRUE(hidden.refits().narrowed(friction));
  EXPECT_LT(friction.fit->chi_squared, chi_squared - 20.0);
  const auto last = static_cast<int>(friction.fit->theta.size()) - 1;
  const double error = friction.fit->standard_error(last);
  EXPECT_GT(round - friction.fit->theta.back(), 2.0 * error);
  EXPECT_NEAR(friction.fit->theta.back(), 0.1, 2.0 * error);
  EXPECT_EQ(rounded(friction).theta.back(), round);
}

bool at_zero_width(const Hypothesis& h) {
  return h.data && h.data->front().to_limit != nullptr;
}

// An unknown effect is missing too; the limit brings the friction nearer to its true value.
TEST(Refits, TakesAHypothesisOfASearchByShareOfTheGapToNoWidth) {
  const Hidden hidden({{"coulomb_friction", 0.4}, {"rebound_factor", 1.03}});
  const Refits by_gap = hidden.refits_of_gap();
  Hypothesis friction = by_gap.with(hidden.base(), candidate("coulomb_friction").probes.at(0));
  const Hypothesis round = friction;
  by_gap.finish_narrowing(friction);
  EXPECT_EQ(friction.fit, round.fit) << "nothing has asked for sharper corners yet";
  ASSERT_TRUE(by_gap.narrowed(friction));
  EXPECT_FALSE(at_zero_width(friction));
  const double on_grids = friction.fit->chi_squared;
  by_gap.finish_narrowing(friction);
  EXPECT_TRUE(at_zero_width(friction));
  EXPECT_LT(friction.fit->chi_squared, on_grids);
  EXPECT_EQ(friction.rounded, round.fit);
}

// When a gain is at the end of its range, about half of the estimates are outside; when it is
// beyond the range, all are.
TEST(Refits, DisqualifiesWhatIsOutsideAndNotWhatIsAtTheEnd) {
  const Candidate gain = candidate("sensor_gain");
  int at_end = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Hidden largest({{"sensor_gain", 1.1}}, 5e-6, seed);
    const Hypothesis h = largest.refits().with(largest.base(), gain.probes.at(0));
    at_end += h.fit->theta.back() == 1.1 ? 1 : 0;
    EXPECT_TRUE(h.disqualified.empty()) << seed << ": " << h.disqualified;
  }
  EXPECT_GT(at_end, 0);
  const Hidden beyond({{"sensor_gain", 1.105}});
  const Hypothesis h = beyond.refits().with(beyond.base(), gain.probes.at(0));
  EXPECT_NE(h.disqualified.find("end of what is physically admissible"), std::string::npos);
}

// Friction is never negative: without friction, chance makes it zero in half of the campaigns.
TEST(Refits, TellsWhichEffectAFitSwitchedOff) {
  const Candidate friction = candidate("viscous_damping");
  int off = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Hidden nothing({}, 5e-6, seed);
    const Hypothesis h = nothing.refits().with(nothing.base(), friction.probes.at(0));
    const bool none = h.fit->theta.back() == 0.0;
    off += none ? 1 : 0;
    EXPECT_EQ(h.disqualified.find("switched off") != std::string::npos, none) << seed;
    const auto line = nothing.refits().switched_off(h);
    ASSERT_EQ(line.has_value(), none) << seed;
    if (line) {
      EXPECT_EQ(h.fit->spec.effects[*line].effect, "viscous_damping");
    }
  }
  EXPECT_GT(off, 0);
  EXPECT_LT(off, 6);
}

// Starts from the parameters of the larger set, which may lie in a minimum that the search did
// not reach.
TEST(Refits, PutsTheSimplerEffectInThePlaceOfTheRicherOne) {
  const Hidden hidden({{"coulomb_friction", 0.2}, {"rebound_factor", 1.5}});
  const Hypothesis rebound =
      hidden.refits().with(hidden.base(), candidate("rebound_damping").probes.at(0));
  const Hypothesis richer =
      hidden.refits().with(rebound, candidate("stribeck_friction").probes.at(0));
  const Hypothesis simpler = hidden.refits().with_instead(
      richer, "stribeck_friction", candidate("coulomb_friction").probes.at(0).line);
  EXPECT_EQ(simpler.effects, (std::vector<std::string>{"coulomb_friction", "rebound_damping"}));
  EXPECT_EQ(simpler.fit->free.size() + 2, richer.fit->free.size());
  EXPECT_TRUE(simpler.disqualified.empty()) << simpler.disqualified;
  EXPECT_NEAR(simpler.fit->theta.back(), 0.2, 0.01);
}

// Value of the last parameter of that name.
double value_of(const HarmonicFit& fit, const std::string& name) {
  const auto& all = fit.model->parameters();
  for (std::size_t k = all.size(); k-- > 0;) {
    if (all[k].name == name) return fit.theta[k];
  }
  ADD_FAILURE() << name;
  return 0.0;
}

// Whatever the catalogue starts the richer effect from, it leaves no more than its special case.
TEST(Refits, StartsTheRicherEffectAsItsSpecialCase) {
  const Hidden hidden({{"coulomb_friction", 0.2}});
  const Hypothesis simpler =
      hidden.refits().with(hidden.base(), candidate("presliding_friction").probes.at(0));
  config::EffectSpec line = candidate("bouc_wen_hysteresis").probes.at(0).line;
  line.parameters["f_h"].start = 50.0;
  line.parameters["gamma"].start = 4.5;
  const auto spec = [&] {
    config::ModelSpec model = simpler.fit->spec;
    model.effects.back() = line;
    return model;
  }();
  const Model richer(spec);
  const auto start =
      carried_across(richer, "bouc_wen_hysteresis", *simpler.fit, "presliding_friction");
  const std::size_t first = start.size() - 4;  // f_h, z0, gamma, n
  EXPECT_EQ(start[first], value_of(*simpler.fit, "f_c"));
  EXPECT_EQ(start[first + 1],
            std::max(value_of(*simpler.fit, "z0"), richer.parameters()[first + 1].lower));
  EXPECT_EQ(start[first + 2], 0.0);
  EXPECT_EQ(start[first + 3], 1.0);
  const Hypothesis found = hidden.refits().with_instead(simpler, "presliding_friction", line);
  EXPECT_EQ(found.effects, std::vector<std::string>{"bouc_wen_hysteresis"});
  EXPECT_LT(found.fit->chi_squared, simpler.fit->chi_squared + 1.0);
}

// What rigid oil does beside viscous damping is in no parameter of the richer effect.
TEST(Refits, TellsWhichEffectsCanStartAsTheirSpecialCase) {
  EXPECT_TRUE(holds_all_of("stribeck_friction", "coulomb_friction"));
  EXPECT_TRUE(holds_all_of("presliding_friction", "coulomb_friction"));
  EXPECT_TRUE(holds_all_of("bouc_wen_hysteresis", "presliding_friction"));
  EXPECT_TRUE(holds_all_of("bouc_wen_hysteresis over current", "presliding_friction over current"));
  EXPECT_TRUE(holds_all_of("power_damping", "viscous_damping"));
  EXPECT_FALSE(holds_all_of("power_damping", "coulomb_friction"));
  EXPECT_FALSE(holds_all_of("oil_compressibility", "viscous_damping"));
  EXPECT_FALSE(holds_all_of("coulomb_friction", "end_stop"));
}

TEST(Refits, KnowsEveryEffectThatAnotherHoldsAsASpecialCase) {
  EXPECT_EQ(
      simpler_than("power_damping over current"),
      (std::vector<std::string>{"viscous_damping over current", "coulomb_friction over current"}));
  EXPECT_TRUE(related("bouc_wen_hysteresis", "coulomb_friction"));
  EXPECT_TRUE(related("viscous_damping", "power_damping"));
  EXPECT_FALSE(related("stribeck_friction", "power_damping"));
  EXPECT_TRUE(simpler_than("end_stop").empty());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
