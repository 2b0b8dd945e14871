#include "drivers/replay/line_reader.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/record/scratch.hpp"

namespace shaker::drivers::replay {
namespace {

TEST(LineReader, BeginsAnewWithEachFile) {
  const record::testing::Scratch scratch;
  const auto file = scratch.path() / "log";
  std::ofstream(file) << "one\ntwo\nthree";
  LineReader reader;
  ASSERT_TRUE(reader.open(file));
  EXPECT_EQ(reader.next(), "one");
  ASSERT_TRUE(reader.open(file)) << "in mid-file";
  for (const char* line : {"one", "two", "three"})
    EXPECT_EQ(reader.next(), line);
  EXPECT_EQ(reader.next(), std::nullopt);
  ASSERT_TRUE(reader.open(file)) << "at its end";
  EXPECT_EQ(reader.next(), "one");
}

TEST(LineReader, NamesAFileThatIsNotThere) {
  LineReader reader;
  const auto opened = reader.open("/nowhere/log");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().what, ::testing::HasSubstr("/nowhere/log: No such file"));
}

}  // namespace
}  // namespace shaker::drivers::replay
