#include "daemon/service/deadman_file.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using ::testing::HasSubstr;

constexpr Nanoseconds kNoon{1'767'268'800'000'000'000};  // 2026-01-01T12:00:00Z

class DeadmanFileTest : public ::testing::Test {
 protected:
  DeadmanFileTest() { write(rig_, R"({"name": "one"})"); }
  static void write(const std::filesystem::path& file, const std::string& text) {
    std::ofstream(file) << text;
  }
  DeadmanFile opened() const { return {folder_, rig_}; }

  record::testing::Scratch scratch_;
  const std::filesystem::path folder_ = scratch_.path();
  const std::filesystem::path rig_ = folder_ / "rig.json";
  const std::filesystem::path proof_ = folder_ / "deadman-proof.json";
};

TEST_F(DeadmanFileTest, KeepsTheProofWithDateAndUser) {
  EXPECT_FALSE(opened().load()) << "nothing is proved yet";
  ASSERT_TRUE(opened().save({0.42, true}, "anna (pid 7)", kNoon));
  const auto seen = opened().load();
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->seconds, 0.42);
  EXPECT_TRUE(seen->in_motion);
  const auto kept = nlohmann::json::parse(std::ifstream(proof_));
  EXPECT_EQ(kept["user"], "anna (pid 7)");
  EXPECT_EQ(kept["how"], "in motion");
  EXPECT_THAT(kept["date"].get<std::string>(), HasSubstr("2026-01-01T12:00:00"));
}

TEST_F(DeadmanFileTest, AsksAgainWhenTheRigFileHasChanged) {
  ASSERT_TRUE(opened().save({0.42, false}, "anna", kNoon));
  ASSERT_TRUE(opened().load());
  EXPECT_FALSE(opened().load()->in_motion);
  write(rig_, R"({"name": "two"})");
  EXPECT_FALSE(opened().load());
  write(rig_, R"({"name": "one"})");
  EXPECT_TRUE(opened().load()) << "the same text is the same rig";
  std::filesystem::remove(rig_);
  EXPECT_FALSE(opened().load()) << "a rig file that cannot be read proves nothing";
}

TEST_F(DeadmanFileTest, BelievesNoProofThatIsDamaged) {
  ASSERT_TRUE(opened().save({0.42, false}, "anna", kNoon));
  const auto good = nlohmann::json::parse(std::ifstream(proof_));
  for (const std::string key : {"seconds", "rig_file"}) {
    auto bad = good;
    bad.erase(key);
    write(proof_, bad.dump());
    EXPECT_FALSE(opened().load()) << key << " is missing";
    bad[key] = true;
    write(proof_, bad.dump());
    EXPECT_FALSE(opened().load()) << key << " is of another type";
  }
  for (const std::string text : {"", "{", "[]", "3"}) {
    write(proof_, text);
    EXPECT_FALSE(opened().load()) << text;
  }
  write(proof_, good.dump());
  EXPECT_TRUE(opened().load());
}

TEST_F(DeadmanFileTest, SaysThatItCannotBeKept) {
  const auto kept = DeadmanFile(folder_ / "nowhere", rig_).save({0.42, false}, "anna", kNoon);
  ASSERT_FALSE(kept);
  EXPECT_THAT(kept.error().what, HasSubstr("asked for again after a restart"));
}

}  // namespace
}  // namespace shaker::daemon
