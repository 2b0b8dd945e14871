#include "mqtt/password_file.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shaker::mqtt {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PasswordFile : public ::testing::Test {
 protected:
  PasswordFile() : file_(fs::temp_directory_path() / ("password." + std::to_string(::getpid()))) {}
  ~PasswordFile() override { fs::remove(file_); }
  Result<std::string> read(const std::string& content, ::mode_t mode = 0600) {
    std::ofstream(file_, std::ios::binary) << content;
    EXPECT_EQ(::chmod(file_.c_str(), mode), 0);
    return read_password(file_);
  }
  fs::path file_;
};

TEST_F(PasswordFile, ItsFirstLineIsThePassword) {
  EXPECT_EQ(read("open sesame\nmore\n").value(), "open sesame");
  EXPECT_EQ(read("dos\r\n").value(), "dos");
  EXPECT_EQ(read(" no end ", 0640).value(), " no end ");
  EXPECT_EQ(read(std::string(1000, 'x')).value().size(), 1000U);
}

TEST_F(PasswordFile, WhatIsNoneIsRefusedWithTheReason) {
  EXPECT_THAT(read("").error().what, HasSubstr("first line is the password"));
  EXPECT_THAT(read("\nsecond").error().what, HasSubstr("first line is the password"));
  EXPECT_THAT(read(std::string(1001, 'x')).error().what, HasSubstr("1 to 1000 bytes"));
  EXPECT_THAT(read("secret", 0644).error().what, HasSubstr("chmod o-r " + file_.string()));
  EXPECT_THAT(read_password("/nowhere/at/all").error().what, HasSubstr("No such file"));
  EXPECT_THAT(read_password(fs::temp_directory_path()).error().what, HasSubstr("is not a file"));
}

}  // namespace
}  // namespace shaker::mqtt
