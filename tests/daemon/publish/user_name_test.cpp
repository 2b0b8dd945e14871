#include "daemon/publish/user_name.hpp"

#include <fstream>

#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

TEST(UserName, IsFoundInTheFile) {
  const record::testing::Scratch scratch;
  const auto users = scratch.path() / "passwd";
  std::ofstream(users) << "root:x:0:0:root:/root:/bin/sh\n\n# a remark\n"
                       << "anna:x:1234:100:Anna,,,:/home/anna:/bin/sh\n"
                       << std::string(10'000, 'x') << ":x:1:1::/:/bin/sh\n";
  EXPECT_EQ(user_name(0, users.c_str()), "root");
  EXPECT_EQ(user_name(1234, users.c_str()), "anna");
  EXPECT_EQ(user_name(4711, users.c_str()), "uid 4711");
  EXPECT_EQ(user_name(0, (scratch.path() / "missing").c_str()), "uid 0");
}

TEST(GroupId, IsFoundInTheFile) {
  const record::testing::Scratch scratch;
  const auto groups = scratch.path() / "group";
  std::ofstream(groups) << "root:x:0:\n# a remark\nshakers:x:7:\nshaker:x:977:anna,bert\n";
  EXPECT_EQ(group_id("shaker", groups.c_str()), gid_t{977});
  EXPECT_EQ(group_id("root", groups.c_str()), gid_t{0});
  EXPECT_EQ(group_id("shake", groups.c_str()), std::nullopt);
  EXPECT_EQ(group_id("shaker", (scratch.path() / "missing").c_str()), std::nullopt);
}

}  // namespace
}  // namespace shaker::daemon
