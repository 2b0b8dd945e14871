// Parts of a blind suite give, together, what one run gives.
#include "tests/blind/shards.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::blind {
namespace {

using ::testing::HasSubstr;

// Answers that no diagnosis gave: every field differs from case to case.
std::vector<Scored> invented(const std::vector<Case>& cases) {
  std::vector<Scored> all;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double x = std::sqrt(1.0 + static_cast<double>(i));
    Scored s{cases[i], {}};
    s.answer.verdict = i % 3 == 0 ? "explained" : i % 3 == 1 ? "unexplained" : "refused";
    s.answer.trouble = i % 3 == 2 ? "the \"run\" is\nshort" : "";
    s.answer.effects = {{cases[i].kind, 1.0 / x, {}}, {"tyre", 0.1 / x, {"free_play"}}};
    s.answer.gap_before = 100.0 / x;
    s.answer.gap_after = i == 5 ? HUGE_VAL : 1.0 + 0.1 / x;
    s.answer.by_chance = 1e-3 / x;
    s.answer.noise_after = x / 7.0;
    s.answer.seconds = 0.1 * x;
    s.null = cases[i].kind == "nothing";
    s.in_catalogue = i % 2 == 0;
    s.detected = i % 5 != 0;
    s.named_first = i % 4 != 0;
    s.in_set = i % 7 != 0;
    s.told_apart = i % 6 != 0;
    s.wrong_and_sure = i % 11 == 0;
    all.push_back(s);
  }
  return all;
}

class Shards : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "shards.XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Keeps the scores in `count` files.
  std::vector<std::filesystem::path> kept(std::size_t count) {
    std::vector<std::filesystem::path> files;
    for (std::size_t index = 1; index <= count; ++index) {
      std::vector<Scored> part;
      for (std::size_t i = index - 1; i < scored_.size(); i += count)
        part.push_back(scored_[i]);
      files.push_back(folder_ / fmt::format("{}-of-{}.jsonl", index, count));
      keep(part, {index, count}, files.back());
    }
    return files;
  }
  std::string refusal(const std::vector<std::filesystem::path>& files) {
    try {
      merge(cases_, files);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
  std::vector<Case> cases_ = all_cases(20);
  std::vector<Scored> scored_ = invented(cases_);
};

TEST_F(Shards, GiveTheTablesOfOneRun) {
  const std::string whole = report(scored_, 0.01);
  for (const std::size_t count : {1U, 7U, 64U})
    EXPECT_EQ(report(merge(cases_, kept(count)), 0.01), whole) << count;
}

TEST_F(Shards, HoldEveryCaseOnce) {
  for (const std::size_t count : {1U, 7U, 64U, 2000U}) {
    std::vector<std::string> labels;
    for (std::size_t index = 1; index <= count; ++index) {
      for (const Case& one : cases_of(cases_, {index, count}))
        labels.push_back(one.label());
    }
    std::vector<std::string> wanted;
    for (const Case& one : cases_)
      wanted.push_back(one.label());
    EXPECT_THAT(labels, ::testing::UnorderedElementsAreArray(wanted)) << count;
  }
}

TEST_F(Shards, AreRefusedWhereACaseIsMissingTwiceOrUnknown) {
  auto files = kept(7);
  EXPECT_THAT(refusal({files.begin(), files.end() - 1}), HasSubstr("run its part again"));
  auto twice = files;
  twice.push_back(files[2]);
  EXPECT_THAT(refusal(twice), HasSubstr("is there twice, first in "));
  std::ofstream(files[3], std::ios::app) << "{\"at\": 3, \"case\": \"end_stop, huge\"}\n";
  EXPECT_THAT(refusal(files), HasSubstr("has no case 3, \"end_stop, huge\""));
  files = kept(7);
  std::ofstream(files[3], std::ios::app) << "{\"case\": \"coulomb";  // cut by a kill
  EXPECT_THAT(refusal(files), HasSubstr("4-of-7.jsonl, line "));
  EXPECT_THAT(refusal({folder_ / "none.jsonl"}), HasSubstr("none.jsonl: cannot be read"));
}

TEST_F(Shards, AreNamedByTwoNumbers) {
  EXPECT_EQ(shard_from("3/7").index, 3U);
  EXPECT_EQ(shard_from("3/7").count, 7U);
  for (const char* bad : {"", "3", "0/7", "8/7", "3/0", "a/b", "3/7x", "-1/7", "1/2/3"})
    EXPECT_THROW(shard_from(bad), std::invalid_argument) << bad;
}

}  // namespace
}  // namespace shaker::blind
