#include "config/json_tree.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

namespace shaker::config {
namespace {

TEST(JsonTree, KnowsTheLineOfEveryValue) {
  const auto root = parse_json(
      "// a comment\n{\n  \"a\": 1,\n  /* two\n lines */ \"b\": 2.5\n  ,\n  \"c\": "
      "[true,\n\"x\"]\n}",
      "f.json");
  ASSERT_TRUE(root) << root.error().what;
  EXPECT_EQ(root->line, 2);
  EXPECT_EQ(root->find("a")->line, 3);
  EXPECT_EQ(root->find("b")->line, 5);
  EXPECT_EQ(root->find("c")->line, 7);
  EXPECT_EQ(root->find("c")->elements.at(1).line, 8);
  EXPECT_DOUBLE_EQ(root->find("b")->number, 2.5);
  EXPECT_EQ(root->find("d"), nullptr);
}

struct Broken {
  const char* text;
  const char* sentence;
};

TEST(JsonTree, SaysWithLineAndColumnWhyItIsBroken) {
  const Broken table[] = {{"", "f.json:1:0: not valid JSON"},
                          {"{\n \"a\": }", "f.json:2:7: not valid JSON"},
                          {"{\n \"a\": 1,\n}", "f.json:3:1: not valid JSON"},
                          {"{\"a\": 1} x", "f.json:1:10: not valid JSON"},
                          {"{\"a\": 1e999}", "number overflow"},
                          {"{\"a\": NaN}", "not valid JSON"},
                          {"{\"a\": \"\xff\"}", "ill-formed UTF-8"},
                          {"{\"a\": 1,\n\"a\": 2}", "f.json:2: key \"a\" occurs twice"},
                          {"/* never closed", "not valid JSON"}};
  for (const Broken& broken : table) {
    SCOPED_TRACE(broken.text);
    const auto root = parse_json(broken.text, "f.json");
    ASSERT_FALSE(root);
    EXPECT_EQ(root.error().kind, ErrorKind::invalid);
    EXPECT_THAT(root.error().what, testing::HasSubstr(broken.sentence));
  }
}

TEST(JsonTree, BoundsTheDepth) {
  const auto nested = [](int depth) {
    return std::string(static_cast<std::size_t>(depth), '[') +
           std::string(static_cast<std::size_t>(depth), ']');
  };
  EXPECT_TRUE(parse_json(nested(kDepthMax), "f.json"));
  const auto deep = parse_json(nested(1'000'000), "f.json");
  ASSERT_FALSE(deep);
  const auto deeper = parse_json(nested(500'000), "f.json");
  ASSERT_FALSE(deeper);
  EXPECT_THAT(deeper.error().what, testing::HasSubstr("nested deeper than 32 levels"));
}

TEST(JsonTree, BoundsTheSizeAndNamesAFileThatIsNotThere) {
  const auto large = parse_json(std::string(kFileBytesMax + 1, ' '), "f.json");
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().what, testing::HasSubstr("1048577 bytes"));
  const auto missing = read_text("no-such-file.json");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().what, "no-such-file.json: cannot be read: No such file or directory");
  const auto directory = read_text("/");
  ASSERT_FALSE(directory);
  EXPECT_THAT(directory.error().what, testing::HasSubstr("is a directory"));
  const auto device = read_text("/dev/zero");
  ASSERT_FALSE(device);
  EXPECT_THAT(device.error().what, testing::HasSubstr("is not a regular file"));
}

TEST(JsonTree, DoesNotWaitForTheOtherEndOfAPipe) {
  const std::string pipe = testing::TempDir() + "json_tree_pipe";
  std::filesystem::remove(pipe);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto read = read_text(pipe);
  std::filesystem::remove(pipe);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().what, testing::HasSubstr("is not a regular file (a pipe"));
}

TEST(JsonTree, ReadsAFileUpToTheLimitThatIsAskedFor) {
  const std::string file = testing::TempDir() + "json_tree_ten_bytes";
  std::ofstream(file) << "0123456789";
  const auto whole = read_text(file, 10);
  ASSERT_TRUE(whole);
  EXPECT_EQ(*whole, "0123456789");
  const auto cut = read_text(file, 9);
  std::filesystem::remove(file);
  ASSERT_FALSE(cut);
  EXPECT_THAT(cut.error().what, testing::HasSubstr("larger than 9 bytes"));
}

TEST(JsonTree, FindsEveryOneOfManyKeysAndTheOneThatOccursTwice) {
  // The order is not alphabetical.
  const auto key = [](int i) { return "k" + std::to_string(i * 7919 % 1000); };
  std::string text = "{";
  for (int i = 0; i < 1000; ++i)
    text += "\"" + key(i) + "\": " + std::to_string(i) + ",\n";
  const auto root = parse_json(text + "\"last\": -1}", "f.json");
  ASSERT_TRUE(root) << root.error().what;
  for (int i = 0; i < 1000; ++i)
    EXPECT_EQ(root->find(key(i))->number, i);
  EXPECT_EQ(root->find("k"), nullptr);
  EXPECT_EQ(root->find("zzz"), nullptr);
  const auto twice = parse_json(text + "\"k500\": -1}", "f.json");
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().what, "f.json:1001: key \"k500\" occurs twice in one object; remove one");
}

}  // namespace
}  // namespace shaker::config
