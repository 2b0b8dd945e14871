// Accepts the complete examples, and refuses each row of bad_input.json, which is one change to
// an example, with the sentence of that row. check_schemas.py uses the same table.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "config/campaign.hpp"
#include "config/rig.hpp"

namespace shaker::config {
namespace {

using Json = nlohmann::json;
const std::filesystem::path kSource = SHAKER_SOURCE_DIR;
const std::filesystem::path kExamples = kSource / "config" / "examples";

Json read(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return Json::parse(stream, nullptr, true, true);
}

// The text of the error; empty for a good file.
std::string verdict(const std::string& name, const std::string& text) {
  const auto what = [](const auto& result) { return result ? std::string() : result.error().what; };
  if (name.starts_with("rig")) return what(parse_rig(text, name));
  if (name.starts_with("model")) return what(parse_model(text, name));
  return what(parse_campaign(text, name, kExamples));
}

TEST(Examples, AreAllGood) {
  int seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    if (entry.path().extension() != ".json") continue;
    ++seen;
    EXPECT_EQ(verdict(entry.path().stem().string(), read(entry.path()).dump()), "")
        << entry.path().filename();
  }
  EXPECT_GE(seen, 10);
}

TEST(BadInput, IsRefusedWithPlaceValueAndWhatIsAllowed) {
  for (const Json& row : read(kSource / "tests" / "config" / "bad_input.json")) {
    SCOPED_TRACE(row.dump());
    const auto name = row["base"].get<std::string>();
    Json document = read(kExamples / (name + ".json"));
    const Json::json_pointer where(row[row.contains("set") ? "set" : "remove"]);
    const Json change = row.contains("set")
                            ? Json{{"op", "add"}, {"path", where.to_string()}, {"value", row["to"]}}
                            : Json{{"op", "remove"}, {"path", where.to_string()}};
    const bool replaces = row.contains("set") && document.contains(where);
    document = document.patch(Json::array(
        {replaces ? Json{{"op", "replace"}, {"path", where.to_string()}, {"value", row["to"]}}
                  : change}));
    EXPECT_THAT(verdict(name, document.dump()),
                testing::HasSubstr(row["sentence"].get<std::string>()));
  }
}

}  // namespace
}  // namespace shaker::config
