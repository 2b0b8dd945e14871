// The short form of the blind suite; `bench/blind_suite` runs all of it.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/blind/suite.hpp"

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

  std::vector<Scored> ask(const std::vector<std::string>& names, std::string_view size) {
    std::vector<Case> chosen;
    for (const Case& c : all_cases(4)) {
      const bool wanted = std::ranges::find(names, c.kind) != names.end();
      if (wanted && c.size == size && c.design == 1 && c.noise == 1) chosen.push_back(c);
    }
    return run(chosen, folder_, 1, [](const Scored&) {});
  }
};

TEST_F(Blind, NamesFrictionAndDampingFirst) {
  for (const Scored& s :
       ask({"coulomb_friction", "rebound_damping", "viscous_damping"}, "medium")) {
    EXPECT_EQ(s.answer.verdict, "explained") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.in_set) << s.hidden.label();
    EXPECT_FALSE(s.wrong_and_sure) << s.hidden.label();
    EXPECT_LE(s.answer.gap_after, 1.1) << s.hidden.label();
  }
}

TEST_F(Blind, NamesNothingWhereNothingIsMissing) {
  for (const Scored& s : ask({"nothing"}, "")) {
    EXPECT_EQ(s.answer.verdict, "adequate") << s.hidden.label() << s.answer.trouble;
    EXPECT_TRUE(s.answer.effects.empty()) << s.hidden.label();
  }
}

TEST_F(Blind, SaysThatItCannotNameWhatIsInNoCatalogue) {
  for (const Scored& s : ask({"detent"}, "large"))
    EXPECT_EQ(s.answer.verdict, "unexplained") << s.hidden.label() << s.answer.trouble;
}

}  // namespace
}  // namespace shaker::blind
