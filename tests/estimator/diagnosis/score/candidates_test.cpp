#include "estimator/diagnosis/score/internal/candidates.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/model.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr MotionRange kRange{0.13, 0.17, 0.3, 10.0};

const Candidate* of(const std::vector<Candidate>& all, const std::string& effect) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Candidate& c) { return c.effect->name() == effect; });
  return found == all.end() ? nullptr : &*found;
}

config::ModelSpec on_tyre() {
  auto model = estimator::testing::oleo_on_tyre(0.15);
  model.effects[3].parameters["k"].start = 2000.0;
  model.effects[4].parameters["c"].start = 4.0;
  return model;
}

TEST(Candidates, OfOneCoordinateSayNothingOfPlaces) {
  std::vector<std::string> notes;
  for (const Candidate& c :
       candidates(estimator::testing::oleo(), kRange, Kind::periodic, notes).tried) {
    for (const Probe& probe : c.probes)
      EXPECT_TRUE(probe.line.sees.empty() && probe.line.acts.empty()) << c.effect->name();
  }
  EXPECT_TRUE(notes.empty());
}

TEST(Candidates, OfTheDamperStandWhereItsOwnEffectsDo) {
  const auto base = on_tyre();
  std::vector<std::string> notes;
  const auto all = candidates(base, kRange, Kind::periodic, notes).tried;
  for (const char* name : {"coulomb_friction", "metering_pin", "free_play"}) {
    const Candidate* found = of(all, name);
    ASSERT_NE(found, nullptr) << name;
    for (const Probe& probe : found->probes) {
      EXPECT_THAT(probe.line.sees, ElementsAre(1.0, 0.0));
      EXPECT_THAT(probe.line.acts, ElementsAre(1.0, -1.0));
    }
  }
  for (const Candidate& c : all) {
    auto larger = base;
    larger.effects.push_back(c.probes.front().line);
    EXPECT_NO_THROW(Model{larger}) << c.effect->name();
  }
}

TEST(Candidates, NameThoseThatHaveNoPlaceAmongSeveralCoordinates) {
  std::vector<std::string> notes;
  auto base = on_tyre();
  auto all = candidates(base, kRange, Kind::periodic, notes).tried;
  for (const char* name : {"tyre", "added_mass", "linear_stiffness"}) {
    EXPECT_EQ(of(all, name), nullptr) << name;
    EXPECT_THAT(notes, Contains(AllOf(HasSubstr("not tried"), HasSubstr(name))));
  }
  EXPECT_THAT(notes, Contains(HasSubstr("orifice_damping sees and acts")));
  notes.clear();
  base.effects.erase(base.effects.begin(), base.effects.begin() + 2);
  all = candidates(base, kRange, Kind::periodic, notes).tried;
  EXPECT_EQ(of(all, "coulomb_friction"), nullptr);
  EXPECT_NE(of(all, "sensor_gain"), nullptr);
  EXPECT_THAT(notes, Contains(HasSubstr("no effect of a damper that sees")));
}

// On the table the mass was weighed. The load cell of a dynamometer may carry any: here the force is that
// of a mass of 10 / (0.3^2 / 0.02).
TEST(Candidates, MayBeAnyMassAlongAnImposedMotion) {
  std::vector<std::string> notes;
  const auto base = estimator::testing::oleo();
  const auto most = [&](const MotionRange& range, Kind kind) {
    const auto all = candidates(base, range, kind, notes).tried;
    auto larger = base;
    larger.effects.push_back(of(all, "added_mass")->probes.front().line);
    return Model(larger).parameters().back().upper;
  };
  EXPECT_DOUBLE_EQ(most(kRange, Kind::periodic), 0.2);
  MotionRange imposed = kRange;
  imposed.imposed = true;
  EXPECT_DOUBLE_EQ(most(imposed, Kind::imposed_motion), 10.0 * 10.0 / (0.3 * 0.3 / 0.02));
}

TEST(Candidates, HaveLoadsInProportionToAnInput) {
  std::vector<std::string> notes;
  const std::vector<DrivingInput> inputs = {{"current", 0.5, ""}, {"voltage", 2.0, "it is off"}};
  const auto base = estimator::testing::oleo();
  const Catalogue all = candidates(base, kRange, Kind::periodic, notes, inputs);
  const auto named = [&](const std::string& name) {
    return std::find_if(all.tried.begin(), all.tried.end(),
                        [&](const Candidate& c) { return c.name() == name; });
  };
  // Of what the model holds too: its coefficient may grow.
  for (const char* name : {"coulomb_friction over current", "bouc_wen_hysteresis over current",
                           "orifice_damping over current", "viscous_damping over current"}) {
    const auto found = named(name);
    ASSERT_NE(found, all.tried.end()) << name;
    EXPECT_EQ(found->probes.front().line.reference, 0.5);
    auto larger = base;
    larger.effects.push_back(found->probes.front().line);
    EXPECT_NO_THROW(Model{larger}) << name;
  }
  for (const char* name : {"rebound_damping over current", "free_play over current",
                           "added_mass over current", "sensor_offset over current"})
    EXPECT_EQ(named(name), all.tried.end()) << name;
  EXPECT_EQ(named("coulomb_friction over voltage"), all.tried.end());
  EXPECT_TRUE(std::any_of(all.not_tried.begin(), all.not_tried.end(), [](const NotTried& n) {
    return n.name == "coulomb_friction over voltage" && n.reason == "it is off";
  }));
}

// Nothing is left out without a word.
TEST(Candidates, AreAllOfTheCatalogueOrNamedWithAReason) {
  config::ModelSpec without = estimator::testing::oleo();
  without.effects.erase(without.effects.begin());
  for (const auto& base : {estimator::testing::oleo(), without, on_tyre()}) {
    for (const Kind kind : {Kind::periodic, Kind::imposed_motion, Kind::transient}) {
      std::vector<std::string> notes;
      const Catalogue all = candidates(base, kRange, kind, notes);
      for (const Effect* effect : catalogue()) {
        const auto named = std::count_if(all.not_tried.begin(), all.not_tried.end(), [&](auto& n) {
          return n.name == effect->name() && !n.reason.empty() && !n.failed;
        });
        EXPECT_EQ(named + (of(all.tried, std::string(effect->name())) != nullptr), 1)
            << effect->name();
      }
    }
  }
  std::vector<std::string> notes;
  const Catalogue lacking = candidates(without, kRange, Kind::periodic, notes);
  EXPECT_NE(of(lacking.tried, "orifice_damping"), nullptr);
  const auto pin = std::find_if(lacking.not_tried.begin(), lacking.not_tried.end(),
                                [](const NotTried& n) { return n.name == "metering_pin"; });
  ASSERT_NE(pin, lacking.not_tried.end());
  EXPECT_EQ(pin->reason, "it changes orifice_damping, which the model does not hold");
}

// The truth is a damper on the table without a tyre: the fit makes the tyre stiff.
TEST(Candidates, OfTheDamperAreNamedInAModelOfSeveralCoordinates) {
  const auto found =
      diagnose(testing::recorded({{"coulomb_friction", 0.2}}, testing::kSixRuns, 5), on_tyre());
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->verdict, Verdict::explained);
  ASSERT_FALSE(found->effects.empty());
  EXPECT_EQ(found->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(found->effects[0].parameters.at(0).value, 0.2, 0.002);
  EXPECT_THAT(found->improved.effects.back().acts, ElementsAre(1.0, -1.0));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
