#include "protocol/documents.hpp"

#include <nlohmann/json.hpp>

#include "tests/protocol/documents_examples.hpp"

namespace shaker::protocol {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kUtc = "2026-03-01T12:00:00.123Z";

json parsed(const Document& document) {
  return json::parse(to_json_line(document, {41, kUtc, 99}));
}

TEST(DocumentLine, BeginsWithTypeAndSequence) {
  const auto line = to_json_line(testing::plain_estimate(), {41, kUtc, 99});
  EXPECT_THAT(line, StartsWith(R"({"type":"estimate","seq":41,"t_utc":"2026-03-01T12:00:00.123Z",)"
                               R"("t_mono_ns":99,)"));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(DocumentLine, OfAnEstimateHasIntervalsAndTheCovarianceAsAMatrix) {
  const json d = parsed(testing::plain_estimate());
  EXPECT_EQ(d["parameters"][0]["interval"], json::parse("[15.25, 17.25]"));
  EXPECT_EQ(d["covariance_order"], json::parse(R"(["theta1", "theta2"])"));
  EXPECT_EQ(d["covariance"], json::parse("[[0.25, -0.125], [-0.0625, 0.0625]]"));
  EXPECT_EQ(d["correlation"], json::parse("[[1.0, -1.0], [-0.5, 1.0]]"));
  EXPECT_FALSE(d.contains("omitted"));
}

TEST(DocumentLine, LeavesOutTheCorrelationWhereAVarianceVanishes) {
  auto estimate = testing::plain_estimate();
  estimate.covariance[3] = 0.0;
  const json d = parsed(estimate);
  EXPECT_FALSE(d.contains("correlation"));
  EXPECT_EQ(d["omitted"][0]["pointer"], "/correlation");
}

TEST(DocumentLine, KeepsEveryBitOfANumber) {
  auto estimate = testing::plain_estimate();
  estimate.sum_of_squares = 0.1 + 0.2;
  estimate.condition = 4.9e-324;
  const json d = parsed(estimate);
  EXPECT_EQ(d["sum_of_squares"].get<double>(), 0.1 + 0.2);
  EXPECT_EQ(d["condition"].get<double>(), 4.9e-324);
}

TEST(DocumentLine, LeavesOutWhatIsNotFiniteAndSaysWhere) {
  auto estimate = testing::plain_estimate();
  estimate.parameters[1].standard_error = std::numeric_limits<double>::quiet_NaN();
  estimate.condition = std::numeric_limits<double>::infinity();
  const json d = parsed(estimate);
  EXPECT_FALSE(d["parameters"][1].contains("standard_error"));
  EXPECT_FALSE(d.contains("condition"));
  EXPECT_EQ(d["omitted"], json::parse(R"([
    {"pointer": "/parameters/1/standard_error", "reason": "not a number"},
    {"pointer": "/condition", "reason": "infinite"}])"));
}

TEST(DocumentLine, ReplacesTextThatIsNotUtf8AndDoesNotCutACharacter) {
  AlarmDocument alarm{"info", "c\xff", {}, {}, {}, {}, {}};
  while (alarm.text.size() < 2000)
    alarm.text += "\xe2\x82\xac";
  const json d = parsed(alarm);
  EXPECT_EQ(d["code"], "c\xef\xbf\xbd");
  const std::string text = d["text"];
  EXPECT_LE(text.size(), 1024U);
  EXPECT_EQ(text.find("\xef\xbf\xbd"), std::string::npos);
  EXPECT_THAT(text, ::testing::EndsWith("\xe2\x82\xac..."));
}

TEST(DocumentLine, LeavesOutWhatThereIsNone) {
  const json d = parsed(StateDocument{});
  EXPECT_FALSE(d.contains("campaign"));
  EXPECT_FALSE(d.contains("eta_s"));
}

TEST(DocumentText, IsTheBodyForPeople) {
  const auto text = to_json_text(testing::plain_estimate());
  EXPECT_THAT(text, StartsWith("{\n  \"type\": \"estimate\",\n"));
  EXPECT_FALSE(json::parse(text).contains("seq"));
}

TEST(DocumentType, NamesEachAlternative) {
  std::vector<std::string> names;
  for (const auto& document : testing::plain_documents())
    names.emplace_back(type_name(document));
  EXPECT_THAT(names, ::testing::ElementsAre("version", "state", "run_start", "cycle", "estimate",
                                            "alarm", "health", "run_stop", "diagnosis_progress",
                                            "diagnosis_result"));
}

}  // namespace
}  // namespace shaker::protocol
