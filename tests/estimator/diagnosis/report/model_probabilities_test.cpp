#include "estimator/diagnosis/report/internal/model_probabilities.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/report/internal/choice.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr int kBaseParameters = 4;
constexpr double kNumbers = 24.0;  // independent ones, in what the best leaves

Hypothesis leaving(const std::vector<std::string>& effects, double chi_squared, double log_evidence,
                   int observations = 100) {
  HarmonicFit fit;
  fit.chi_squared = chi_squared;
  fit.observations = observations;
  fit.free.resize(kBaseParameters + effects.size());
  Hypothesis h;
  h.effects = effects;
  h.fit = std::make_shared<const HarmonicFit>(std::move(fit));
  h.added = static_cast<int>(effects.size());
  h.log_evidence = log_evidence;
  return h;
}

// The result of a search over a catalogue of 31 effects.
class Found {
 public:
  explicit Found(const std::vector<Hypothesis>& hypotheses, bool explained, double by_noise)
      : catalogue_(31) {
    double least = 1e6;
    for (const Hypothesis& h : hypotheses)
      least = std::min(least, h.fit->chi_squared);
    const auto observations = static_cast<int>(std::sqrt(kNumbers * least));
    selection_.base = leaving({}, 1e6, -4e5, observations);
    for (const Hypothesis& h : hypotheses)
      selection_.hypotheses.push_back(
          leaving(h.effects, h.fit->chi_squared, h.log_evidence, observations));
    const auto less = [](const Hypothesis& a, const Hypothesis& b) {
      return a.log_evidence < b.log_evidence;
    };
    selection_.best = static_cast<std::size_t>(
        std::max_element(hypotheses.begin(), hypotheses.end(), less) - hypotheses.begin());
    selection_.explained = explained;
    selection_.probability_best = by_noise;
    for (const Candidate& candidate : catalogue_) {
      Score score;
      score.candidate = &candidate;
      selection_.base_scoring.scores.push_back(score);
    }
  }
  double probability_of(const std::string& effect) const { return probability_of_any({effect}); }
  double probability_of_any(const std::vector<std::string>& effects) const {
    const std::vector<RunDatum> none;
    Choice choice(selection_, none);
    return ModelProbabilities(selection_, none, agree(selection_, none, choice))
        .probability_of_any(effects);
  }
  std::vector<std::string> answer() const {
    const std::vector<RunDatum> none;
    return selection_.hypotheses[*answer_of(selection_, none)].effects;
  }
  double imitates(std::size_t k) const {
    const std::vector<RunDatum> none;
    Choice choice(selection_, none);
    return ModelProbabilities(selection_, none, agree(selection_, none, choice)).imitates(k);
  }

 private:
  std::vector<Candidate> catalogue_;
  Selection selection_;
};

// An unknown effect makes the gap; that a name closes seven tenths of it by chance has the
// probability 0.3, and two names together 0.3 (1 - log 0.3). Beside the unknown stands a name with
// the odds 0.2 to that.
TEST(ModelProbabilities, SayHowLikelyANameOnlyImitates) {
  const std::vector<Hypothesis> left = {leaving({"tyre"}, 3e5, -2e5),
                                        leaving({"tyre", "viscous_damping"}, 3e5, -2.1e5),
                                        leaving({"viscous_damping"}, 1e3, -600.0)};
  const Found unexplained(left, false, 0.0);
  EXPECT_NEAR(unexplained.imitates(0), 0.3 / 0.5, 1e-6);
  EXPECT_NEAR(unexplained.imitates(1), 0.6612 / 0.8612, 1e-4);
  EXPECT_NEAR(unexplained.imitates(2), 1e-3 / 0.201, 1e-6);
  EXPECT_EQ(Found(left, true, 0.5).imitates(0), 0.0);
}

TEST(ModelProbabilities, AskMoreOfASecondNameThanToBeTheBestOfManyPairs) {
  const Hypothesis one = leaving({"viscous_damping"}, 105.0, -52.0);
  // The prior probability of a pair is 2 x 0.1 / 30; exp(5.01) in its favour makes it as likely
  // as the single effect.
  const Found even({one, leaving({"tyre", "viscous_damping"}, 85.0, -52.0 + std::log(150.0))}, true,
                   0.5);
  EXPECT_NEAR(even.probability_of("tyre"), 0.49, 0.002);
  EXPECT_NEAR(even.probability_of("viscous_damping"), 0.98, 0.001);
  const Found doubtful({one, leaving({"tyre", "viscous_damping"}, 95.0, -49.0)}, true, 0.5);
  EXPECT_LT(doubtful.probability_of("tyre"), 0.15);
  EXPECT_GT(doubtful.probability_of("viscous_damping"), 0.97);
  const Found sure({leaving({"viscous_damping"}, 900.0, -180.0),
                    leaving({"tyre", "viscous_damping"}, 95.0, -49.0)},
                   true, 0.5);
  EXPECT_GT(sure.probability_of("tyre"), 0.95);
  EXPECT_GT(sure.probability_of("viscous_damping"), 0.95);
}

TEST(ModelProbabilities, DoubtANameBesideAnUnknownAsOftenAsTheUnknownIsImitated) {
  // A quarter of the squared gap remains. An unknown effect alone is imitated so well in a
  // quarter of all cases; that it stands beside the named effect is 0.2 times as frequent.
  const Found quarter({leaving({"tyre"}, 2.5e5, -1e5)}, false, 0.0);
  EXPECT_NEAR(quarter.probability_of("tyre"), 0.2 / 0.45, 1e-6);
  // No effect imitates another to a millionth.
  const Found nearly({leaving({"tyre"}, 250.0, -120.0)}, false, 0.0);
  EXPECT_EQ(nearly.probability_of("tyre"), kMostUnexplained);
  // The remaining gap may be chance.
  const Found chance({leaving({"tyre"}, 2.5e5, -1e5)}, false, 0.009);
  EXPECT_GT(chance.probability_of("tyre"), 0.8);
}

// Three effects that leave a little less than the two that are the answer are no reason to doubt
// the two.
TEST(ModelProbabilities, LeaveTheAnswerBesideAGapItsNames) {
  const Found found({leaving({"tyre"}, 1.2e5, -5e4), leaving({"cavitation", "tyre"}, 5e3, -2e3),
                     leaving({"end_stop", "metering_pin", "tyre"}, 4.8e3, -1.9e3)},
                    false, 0.0);
  EXPECT_GT(found.probability_of("tyre"), 0.8);
  EXPECT_GT(found.probability_of("cavitation"), 0.8);
  EXPECT_EQ(found.probability_of("end_stop"), 0.0);
}

// Each of the two halves the gap more than once; together they imitate more easily than one.
TEST(ModelProbabilities, DoubtTheFirstOfTwoThatCloseAGapTogether) {
  const Hypothesis one = leaving({"tyre"}, 3e5, -1.2e5);
  const Found both({one, leaving({"cavitation", "tyre"}, 3e4, -1.2e4)}, false, 0.0);
  EXPECT_NEAR(both.probability_of("tyre"), 0.2 / (0.2 + 0.03 * (1.0 - std::log(0.03))), 1e-6);
  EXPECT_NEAR(both.probability_of("cavitation"), 0.2 / (0.2 + 0.1), 1e-6);
}

// The simplest first, then what adds most to it, would end at the stop and the play. What closes far
// more than they do counts, though one of its effects closes less alone.
TEST(ModelProbabilities, AnswerWithTheSetThatWeighsMost) {
  const Found found(
      {leaving({"coulomb_friction"}, 2.8e5, -6e2), leaving({"presliding_friction"}, 9.2e4, -2e2),
       leaving({"cubic_stiffness"}, 9e5, -7e2),
       leaving({"coulomb_friction", "free_play"}, 7.7e4, -1.9e2),
       leaving({"cubic_stiffness", "presliding_friction"}, 1.6e3, -7.1e1),
       leaving({"coulomb_friction", "cubic_stiffness", "free_play"}, 3.2e3, -1.3e2)},
      false, 0.0);
  EXPECT_THAT(found.answer(), ::testing::ElementsAre("cubic_stiffness", "presliding_friction"));
  EXPECT_GT(found.probability_of("presliding_friction"), 0.8);
}

TEST(ModelProbabilities, AddUpOverRivalsOfOneKind) {
  const Found rivals({leaving({"tyre"}, 105.0, -52.0), leaving({"cavitation"}, 105.0, -52.0)}, true,
                     0.5);
  EXPECT_NEAR(rivals.probability_of("tyre"), 0.49, 0.002);
  EXPECT_NEAR(rivals.probability_of_any({"tyre", "cavitation"}), 0.98, 0.002);
}

// Both in one hypothesis are counted once, and imitate as easily as one does.
TEST(ModelProbabilities, CountTwoOfOneKindInOneHypothesisOnce) {
  const Hypothesis one = leaving({"tyre"}, 3e5, -1.2e5);
  const Found both({one, leaving({"cavitation", "tyre"}, 3e4, -1.2e4)}, false, 0.0);
  EXPECT_NEAR(both.probability_of_any({"cavitation", "tyre"}), 0.2 / (0.2 + 0.03), 1e-6);
  EXPECT_GT(both.probability_of_any({"cavitation", "tyre"}), both.probability_of("tyre"));
}

// By simulation: the remaining fractions are uniform on 0..1, one for each effect.
// Without both only the base model was fitted, which takes three effects more; without one a pair.
TEST(ModelProbabilities, AreForAnyOfAKindNoLessThanForOne) {
  const Found both({leaving({"cavitation", "cubic_stiffness", "tyre"}, 1e5, -4e4),
                    leaving({"cubic_stiffness", "tyre"}, 5e5, -2e5)},
                   false, 0.0);
  EXPECT_GT(both.probability_of("cavitation"), 0.3);
  EXPECT_GE(both.probability_of_any({"cavitation", "tyre"}), both.probability_of("cavitation"));
}

TEST(ModelProbabilities, ImitateAsOftenAsEvenSharesMultiplyToThat) {
  std::mt19937_64 source(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  constexpr int kDraws = 200000;
  for (const int effects : {1, 2, 3}) {
    for (const double left : {0.02, 0.3}) {
      int hits = 0;
      for (int draw = 0; draw < kDraws; ++draw) {
        double product = 1.0;
        for (int e = 0; e < effects; ++e)
          product *= share(source);
        hits += product <= left ? 1 : 0;
      }
      const double p = chance_to_imitate(left, effects);
      EXPECT_NEAR(static_cast<double>(hits) / kDraws, p, 4.0 * std::sqrt(p * (1.0 - p) / kDraws));
    }
  }
  EXPECT_EQ(chance_to_imitate(0.0, 2), 0.0);
  EXPECT_EQ(chance_to_imitate(1.0, 3), 1.0);
}

// The three have a tenth more evidence, and few dampers lack three effects.
TEST(ModelProbabilities, NameNothingThatWouldBeStatedAsZero) {
  const Found found({leaving({"tyre"}, 105.0, -52.0),
                     leaving({"coulomb_friction", "tyre", "viscous_damping"}, 104.0, -51.9)},
                    true, 0.5);
  EXPECT_LT(found.probability_of("viscous_damping"), 0.005);
  EXPECT_THAT(found.answer(), ::testing::ElementsAre("tyre"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
