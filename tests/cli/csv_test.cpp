#include "cli/csv.hpp"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

const std::vector<std::vector<std::string>> kWanted = {{"t", "excitation", "displacement"},
                                                       {"t", "y"}};

Result<CsvTable> read(const std::string& text) {
  std::istringstream in(text);
  return read_csv(in, "f.csv", kWanted);
}

TEST(Csv, FindsColumnsByNameAmongOthers) {
  const auto table = read("y,comment,t\n1.5,7,0\n-2e-3,8,0.25\n");
  ASSERT_TRUE(table) << table.error().what;
  EXPECT_THAT(table->columns.at("t"), testing::ElementsAre(0.0, 0.25));
  EXPECT_THAT(table->columns.at("y"), testing::ElementsAre(1.5, -2e-3));
  EXPECT_FALSE(table->columns.contains("comment"));
}

TEST(Csv, TakesWindowsLineEndsByteOrderMarkBlanksAndAMissingLastLineBreak) {
  const auto table = read("\xEF\xBB\xBFt, y\r\n0 ,\t1\r\n\r\n1,+2");
  ASSERT_TRUE(table) << table.error().what;
  EXPECT_THAT(table->columns.at("y"), testing::ElementsAre(1.0, 2.0));
}

TEST(Csv, ReadsTheUnitBehindAName) {
  const auto table = read("t [ms],note (of the day), y (mm)\n0,7,1\n");
  ASSERT_TRUE(table) << table.error().what;
  EXPECT_THAT(table->columns.at("y"), testing::ElementsAre(1.0));
  EXPECT_THAT(table->units,
              testing::ElementsAre(testing::Pair("t", "ms"), testing::Pair("y", "mm")));
  EXPECT_FALSE(read("t [s],t,y\n0,0,1\n")) << "t twice";
}

TEST(Csv, PrefersTheMeasuredExcitation) {
  const auto table = read("t,y,displacement,excitation\n0,1,2,3\n");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->columns.size(), 3u);
  EXPECT_THAT(table->columns.at("displacement"), testing::ElementsAre(2.0));
}

TEST(Csv, SaysWhereItIsWrongAndWhy) {
  const struct {
    const char* text;
    const char* sentence;
  } table[] = {
      {"", "f.csv: is empty; a header row is wanted"},
      {"0,1\n1,2\n",
       "f.csv:1: the header row is \"0,1\"; columns t,excitation,displacement or t,y"},
      {"t,x\n0,1\n", "the header row is \"t,x\""},
      {"t,t,y\n0,1,2\n", "f.csv:1: column \"t\" occurs twice"},
      {"t,y\n0,1\n1,abc\n", "f.csv:3:2: \"abc\" is not a number (y)"},
      {"t,y\n0,\n", "f.csv:2:2: \"\" is not a number (y)"},
      {"t,y\n0,nan\n", "f.csv:2:2: \"nan\" is not a finite number (y)"},
      {"t,y\n-inf,1\n", "f.csv:2:1: \"-inf\" is not a finite number (t)"},
      {"t,y\n0,1e999\n", "f.csv:2:2: \"1e999\" is not a number"},
      {"t,y\n0,0x10\n", "f.csv:2:2: \"0x10\" is not a number"},
      {"t,y\n0,1,2\n", "f.csv:2: 3 fields; the header has 2"},
      {"t,y\n0\n", "f.csv:2: 1 fields; the header has 2"},
      {"t;y\n0;1\n", "the header row is \"t;y\""},
  };
  for (const auto& row : table) {
    SCOPED_TRACE(row.text);
    const auto result = read(row.text);
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().what, testing::HasSubstr(row.sentence));
  }
}

TEST(Csv, BoundsTheLine) {
  const auto result = read("t,y\n" + std::string(kMaxCsvLine + 1, '1'));
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().what, testing::HasSubstr("f.csv:2: longer than 65536 bytes"));
}

TEST(Csv, NamesAFileThatIsNotThere) {
  const auto result = read_csv("no-such.csv", kWanted);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().what, "no-such.csv: cannot be read: No such file or directory");
}

}  // namespace
}  // namespace shaker::cli
