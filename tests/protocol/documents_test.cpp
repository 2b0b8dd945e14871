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

// A list contains at most 32 alternatives or 64 channels, and the number of those left out.
TEST(DocumentLine, GivesSoManyEntriesOfAListAndCountsTheRest) {
  AlarmDocument alarm;
  for (const std::size_t count : {1, 32, 33, 40}) {
    alarm.alternatives.assign(count, "theta1");
    alarm.alternatives.front() = "first";
    const json d = parsed(alarm);
    EXPECT_EQ(d["alternatives"].size(), std::min<std::size_t>(count, 32)) << count;
    EXPECT_EQ(d["alternatives"][0], "first");
    if (count <= 32) {
      EXPECT_FALSE(d.contains("omitted")) << count;
    } else {
      EXPECT_EQ(d["omitted"], json::array({{{"pointer", "/alternatives/32"},
                                            {"reason", std::to_string(count - 32) + " more"}}}));
    }
  }
  HealthDocument health;
  health.channels.resize(64);
  EXPECT_EQ(parsed(health)["channels"].size(), 64u);
  EXPECT_EQ(parsed(health).value("omitted", json::array()).dump().find("more"), std::string::npos);
  health.channels.resize(65);
  EXPECT_EQ(parsed(health)["channels"].size(), 64u);
  EXPECT_THAT(parsed(health)["omitted"].dump(), HasSubstr("1 more"));
}

TEST(DocumentLine, KeepsANameOfItsLargestLength) {
  AlarmDocument alarm;
  alarm.code = std::string(96, 'c');
  alarm.text = std::string(1024, 't');
  EXPECT_EQ(parsed(alarm)["code"], alarm.code);
  EXPECT_EQ(parsed(alarm)["text"], alarm.text);
  alarm.code += 'x';
  EXPECT_EQ(parsed(alarm)["code"], std::string(93, 'c') + "...");
}

TEST(DocumentLine, CarriesEveryMemberOfAnAlarm) {
  AlarmDocument alarm;
  alarm.severity = "error";
  alarm.code = "frozen_sensor";
  alarm.cause = "sensor_link";
  alarm.action = "ramp_down";
  alarm.channel = "displacement";
  alarm.value = 0.5;
  alarm.limit = 0.25;
  alarm.parameter = "theta1";
  alarm.run = "slow";
  alarm.cycle = 7;
  alarm.standard_error = 0.125;
  alarm.alone = true;
  const json d = parsed(alarm);
  const json expected = {{"severity", "error"},
                         {"code", "frozen_sensor"},
                         {"cause", "sensor_link"},
                         {"action", "ramp_down"},
                         {"channel", "displacement"},
                         {"value", 0.5},
                         {"limit", 0.25},
                         {"parameter", "theta1"},
                         {"run", "slow"},
                         {"cycle", 7},
                         {"standard_error", 0.125},
                         {"alone", true}};
  for (const auto& [key, value] : expected.items())
    EXPECT_EQ(d[key], value) << key;
}

TEST(DocumentLine, OfAnEstimateSaysWhetherItsIntervalsHoldAndTheGap) {
  EstimateDocument estimate;
  EXPECT_EQ(parsed(estimate)["parameters"], json::array());
  EXPECT_EQ(parsed(estimate)["intervals_hold"], true);
  EXPECT_FALSE(parsed(estimate).contains("gap"));
  estimate.intervals_hold = false;
  estimate.gap = 0.25;
  estimate.noise_floor = 0.125;
  EXPECT_EQ(parsed(estimate)["intervals_hold"], false);
  EXPECT_EQ(parsed(estimate)["gap"], 0.25);
  EXPECT_EQ(parsed(estimate)["noise_floor"], 0.125);
}

TEST(DocumentLine, HasTheCovarianceOf64ParametersAndNotOf65) {
  EstimateDocument estimate;
  for (const std::size_t n : {64, 65}) {
    estimate.covariance_order.assign(n, "p");
    estimate.covariance.assign(n * n, 0.5);
    EXPECT_EQ(parsed(estimate).contains("covariance"), n == 64) << n;
  }
  EXPECT_THAT(parsed(estimate)["omitted"].dump(), HasSubstr("more than 64 parameters"));
}

TEST(DocumentLine, OfARigHasEachOfItsLimits) {
  RigDocument rig;
  rig.stroke_min_m = 1.0;
  rig.stroke_max_m = 2.0;
  rig.stroke_rate_max_m_s = 3.0;
  rig.excitation_max_m_s2 = 4.0;
  rig.frequency_min_hz = 5.0;
  rig.frequency_max_hz = 6.0;
  rig.stale_s = 7.0;
  rig.ramp_s = 8.0;
  rig.client_lease_s = 9.0;
  rig.unprotected = true;
  const json d = parsed(rig);
  int k = 0;
  for (const char* key :
       {"stroke_min_m", "stroke_max_m", "stroke_rate_max_m_s", "excitation_max_m_s2",
        "frequency_min_hz", "frequency_max_hz", "stale_s", "ramp_s", "client_lease_s"})
    EXPECT_EQ(d.value(key, 0.0), ++k) << key;
  EXPECT_EQ(d["unprotected"], true);
}

TEST(DocumentLine, OfARigHasTheSpecimenThatThereIs) {
  RigDocument rig = testing::plain_rig();
  EXPECT_EQ(parsed(rig)["plan"]["specimen"], json({{"serial", "N-042"}, {"charge", "18 bar"}}));
  rig.plan->specimen.clear();
  EXPECT_FALSE(parsed(rig)["plan"].contains("specimen"));
}

TEST(DocumentLine, OfAScopeHasTheLengthOfABin) {
  EXPECT_EQ(parsed(ScopeDocument{0.02, {}})["bin_s"], 0.02);
  ScopeDocument scope{0.02, {}};
  auto& channel = scope.channels.emplace_back();
  channel.channel = "displacement";
  channel.bin = {7, 9};
  channel.smallest = {0.25, 0.5};
  channel.largest = {0.75, 1.0};
  const json shown = parsed(scope)["channels"][0];
  EXPECT_EQ(shown["channel"], "displacement");
  EXPECT_EQ(shown["bin"], json::parse("[7, 9]"));
  EXPECT_EQ(shown["min"], json::parse("[0.25, 0.5]"));
  EXPECT_EQ(shown["max"], json::parse("[0.75, 1.0]"));
}

TEST(DocumentLine, OfADiagnosisHasAShareBetween0And1) {
  for (const auto& [given, wanted] :
       {std::pair{-0.5, 0.0}, {0.0, 0.0}, {0.25, 0.25}, {1.0, 1.0}, {1.5, 1.0}})
    EXPECT_EQ(parsed(DiagnosisProgressDocument{"c", "naming", given})["share"], wanted) << given;
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
                                            "diagnosis_result", "wave", "scope", "rig"));
}

TEST(Wave, KeepsSevenDigitsOfEachPoint) {
  const WaveDocument wave{2, 7, true, 2.5, {0.123456789, -1e-12}, {}, {}, {}};
  const auto line = json::parse(to_json_line(wave, {41, "", 0}));
  EXPECT_EQ(line["stroke_m"], json::parse("[0.1234568, -1e-12]"));
  EXPECT_EQ(line["run_index"], 2);
  EXPECT_FALSE(line.contains("response_m"));
  EXPECT_FALSE(line.contains("omitted"));
}

// 900 KiB as it goes out, however its text was written.
TEST(DocumentLine, HoldsADiagnosisOf900KiBAndNoneOfMore) {
  constexpr std::size_t kMost = 900 * 1024;
  const std::string around = R"({"x":""})";
  for (const std::size_t more : {0u, 1u}) {
    DiagnosisResultDocument result{"c", "c.db", "done", "found", "/data/c.diagnosis"};
    result.diagnosis = " { \"x\" : \"" + std::string(kMost + more - around.size(), 'a') + "\" } ";
    const json d = parsed(result);
    EXPECT_EQ(d.contains("diagnosis"), more == 0);
    EXPECT_EQ(d.contains("omitted"), more == 1);
  }
}

}  // namespace
}  // namespace shaker::protocol
