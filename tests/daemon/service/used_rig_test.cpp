#include "daemon/service/used_rig.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class UsedRig : public ::testing::Test {
 protected:
  record::testing::Scratch scratch_;
  const std::filesystem::path folder_ = scratch_.path();
};

TEST_F(UsedRig, IsKeptInTheServicesFolder) {
  ::setenv("RUNTIME_DIRECTORY", folder_.c_str(), 1);
  EXPECT_EQ(used_rig_file(), folder_ / "rig.json");
  ::unsetenv("RUNTIME_DIRECTORY");
  EXPECT_EQ(used_rig_file(), "");
  EXPECT_TRUE(keep_used_rig("", "text")) << "a daemon without a service's folder keeps none";
}

TEST_F(UsedRig, ReplacesTheOneOfAnEarlierDaemon) {
  const auto file = folder_ / "rig.json";
  ASSERT_TRUE(keep_used_rig(file, "a long first text"));
  std::ofstream(folder_ / "rig.json.new") << "left by a daemon that was killed";
  ASSERT_TRUE(keep_used_rig(file, "short"));
  EXPECT_EQ(content(file), "short");
}

TEST_F(UsedRig, SaysWhyItCannotBeKept) {
  const auto kept = keep_used_rig(folder_ / "nowhere" / "rig.json", "text");
  ASSERT_FALSE(kept);
  EXPECT_THAT(kept.error().what, ::testing::HasSubstr("No such file or directory"));
  EXPECT_THAT(kept.error().what, ::testing::HasSubstr("goes by the rig file itself"));
}

}  // namespace
}  // namespace shaker::daemon
