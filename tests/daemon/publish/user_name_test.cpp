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

}  // namespace
}  // namespace shaker::daemon
