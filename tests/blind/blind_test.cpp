// The short form of the blind suite; `bench/blind_suite` runs all of it.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/blind/suite.hpp"
#include "tests/sanitized.hpp"

namespace shaker::blind {
namespace {

class Blind : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "blind.XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;

  static std::vector<Case> cases_of(const std::vector<std::string>& names, std::string_view size,
                                    int design = 1, int noise = 1) {
    std::vector<Case> chosen;
    for (const Case& c : all_cases(4)) {
      const bool wanted = std::ranges::find(names, c.kind) != names.end();
      const bool usual = c.kind == "nothing" || (c.design == design && c.noise == noise);
      if (wanted && c.size == size && usual) chosen.push_back(c);
    }
    return chosen;
  }
  std::vector<Scored> ask(const std::vector<Case>& cases) {
    return run(cases, folder_, 1, [](const Scored&) {});
  }
  std::vector<Scored> ask(const std::vector<std::string>& names, std::string_view size,
                          int design = 1, int noise = 1) {
    const std::vector<Case> cases = cases_of(names, size, design, noise);
    EXPECT_FALSE(cases.empty());
    return ask(cases);
  }
};

TEST_F(Blind, NamesFrictionAndDampingFirst) {
  double squares = 0.0, count = 0.0;
  for (const Scored& s : ask({"coulomb_friction", "pressure_friction", "presliding_friction",
                              "rebound_damping", "viscous_damping", "metering_pin"},
                             "medium")) {
    EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.in_set) << s.hidden.label();
    EXPECT_FALSE(s.wrong_and_sure) << s.hidden.label();
    EXPECT_TRUE(s.named_first) << s.hidden.label();
    squares += s.answer.noise_after * s.answer.noise_after;
    count += 1.0;
    EXPECT_LE(s.answer.gap_after, 1.1) << s.hidden.label();
  }
  EXPECT_EQ(count, 6.0);
  EXPECT_LE(std::sqrt(squares / count), 1.1);
}

// Draws of the noise in which a smoothed dry friction leaves no more than noise, and a static
// peak at low speed corrects what it leaves.
TEST_F(Blind, NamesDryFrictionWhereARoundCornerLooksLikeAStaticPeak) {
  const Case friction = cases_of({"coulomb_friction"}, "medium").at(0);
  std::vector<Case> draws;
  for (const std::uint64_t seed : some({1401U, 1429U, 1439U})) {
    draws.push_back(friction);
    draws.back().seed = seed;
  }
  for (const Scored& s : ask(draws)) {
    EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.named_first) << s.hidden.label();
    ASSERT_EQ(s.answer.effects.size(), 1U) << s.hidden.label();
    EXPECT_GT(s.answer.effects[0].probability, 0.95) << s.hidden.label();
  }
}

// Friction that sticks for a large part of the cycle: a smoothed friction is wrong by 500
// standard errors.
TEST_F(Blind, ExplainsDryFrictionThatSticks) {
  for (const Scored& s : ask({"coulomb_friction"}, "large", 0, 1)) {
    EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.named_first) << s.hidden.label();
    EXPECT_LE(s.answer.gap_after, 1.1) << s.hidden.label();
  }
}

// The modes of the base model remove the transient of another damper from the cycles.
TEST_F(Blind, ExplainsALargeEffectByTheErrorsThatItTellsItself) {
  for (const Scored& s : ask({"presliding_friction"}, "large", 0, 2)) {
    EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.named_first) << s.hidden.label();
    EXPECT_LE(s.answer.gap_after, 1.1) << s.hidden.label();
  }
}

// A gas that exchanges heat replaces the polytropic exponent. From the fit of the base model
// the search falls into a minimum without heat exchange, in which other effects correct the
// residual. The forces along the measured motion lead to the true minimum, or a candidate set
// with the other effect switched off does.
TEST_F(Blind, ExplainsGasThatExchangesHeat) {
  for (const char* size : some({"small", "medium"})) {
    for (const Scored& s : ask({"gas_heat_transfer"}, size, 1, 0)) {
      EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
      EXPECT_TRUE(s.named_first) << s.hidden.label();
      EXPECT_LE(s.answer.gap_after, 1.1) << s.hidden.label();
    }
  }
}

// In this draw the transient first hides a harmonic to which a resonance carries the
// excitation's noise. With the sensor's noise alone as its error, the harmonic would be off by
// 7.3 standard errors.
TEST_F(Blind, CountsTheExcitationsNoiseInHarmonicsThatOnlyShowOnceTheTransientIsGone) {
  Case slow = cases_of({"nothing"}, "").at(0);
  slow.design = 0;
  slow.noise = 1;
  slow.seed = 380309;
  for (const Scored& s : ask({slow}))
    EXPECT_EQ(s.answer.verdict, "adequate") << s.hidden.label() << s.answer.trouble;
}

TEST_F(Blind, NamesNothingWhereNothingIsMissing) {
  const auto all = ask({"nothing"}, "");
  ASSERT_EQ(all.size(), 4U);
  for (const Scored& s : all) {
    EXPECT_EQ(s.answer.verdict, "adequate") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.answer.effects.empty()) << s.hidden.label();
  }
}

TEST(Evenness, TellsEvenChancesFromLeaningOnes) {
  std::vector<double> even, leaning;
  for (int i = 0; i < 200; ++i) {
    even.push_back((i + 0.5) / 200.0);
    leaning.push_back(std::pow((i + 0.5) / 200.0, 1.3));
  }
  EXPECT_NEAR(evenness(even).distance, 0.0025, 1e-12);
  EXPECT_EQ(evenness(even).chance, 1.0);
  EXPECT_LT(evenness(leaning).chance, 0.05);
  // The 5 % point for 100 draws in the table is 1.36 / 10.
  std::vector<double> shifted;
  for (int i = 0; i < 100; ++i)
    shifted.push_back(std::min(1.0, (i + 0.5) / 100.0 + 0.1294));
  EXPECT_NEAR(evenness(shifted).chance, 0.05, 0.005);
}

TEST_F(Blind, SaysThatItCannotNameWhatIsInNoCatalogue) {
  for (const Scored& s : ask({"detent"}, "large"))
    EXPECT_EQ(s.answer.verdict, "unexplained") << s.hidden.label() << s.answer.trouble;
}

}  // namespace
}  // namespace shaker::blind
