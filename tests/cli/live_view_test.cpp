#include "cli/live_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

using Json = nlohmann::json;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

Json rig_state(const char* name, Json more = Json::object()) {
  Json document = {{"type", "state"}, {"state", name}, {"reason", ""}};
  document.update(more);
  return document;
}

Json alarm(const char* severity, const char* code, const char* text = "the text") {
  return {{"type", "alarm"},
          {"severity", severity},
          {"code", code},
          {"text", text},
          {"t_utc", "2026-03-01T12:34:56.789Z"}};
}

// An estimate with more lines than an operator's terminal has.
Json estimate() {
  Json parameters = Json::array();
  for (int i = 0; i < 30; ++i)
    parameters.push_back({{"name", "theta" + std::to_string(i)},
                          {"value", 1.0},
                          {"unit", "m"},
                          {"determined", true},
                          {"standard_error", 0.1},
                          {"interval", {0.8, 1.2}}});
  return {{"type", "estimate"}, {"parameters", parameters}, {"usable", true}, {"cycles_used", 3}};
}

std::vector<std::string> texts(const LiveView& view) {
  std::vector<std::string> found;
  for (const auto& line : view.lines(80, 24))
    found.push_back(line.text);
  return found;
}

TEST(LiveView, ShowsAnAlarmAboveAnEstimateThatIsTallerThanTheTerminal) {
  LiveView view;
  view.take({{"type", "version"}, {"program", "shakerd"}, {"version", "1"}, {"rig", "r"}});
  view.take(rig_state("MEASURE"));
  view.take(estimate());
  EXPECT_FALSE(view.take(alarm("warning", "slow_sensor")));
  EXPECT_TRUE(view.take(alarm("error", "emergency_stop"))) << "the bell rings";
  const auto lines = view.lines(80, 24);
  ASSERT_THAT(lines, SizeIs(24));
  EXPECT_EQ(lines[2].text, "ALARM since 12:34:56 UTC: the text");
  EXPECT_EQ(lines[2].style, LiveView::Style::alarm);
  EXPECT_EQ(lines[3].text, "warning since 12:34:56 UTC: the text");
}

TEST(LiveView, KeepsAnAlarmUntilItIsAcknowledged) {
  LiveView view;
  view.take(rig_state("FAULT"));
  view.take(alarm("error", "stroke_limit"));
  for (int i = 0; i < 20; ++i) {  // many things happen meanwhile
    view.take(alarm("error", "stroke_limit"));
    view.take({{"type", "run_stop"}, {"run", "r"}, {"status", "fail"}});
    view.take(alarm("info", "note"));
  }
  EXPECT_THAT(texts(view), Contains("ALARM since 12:34:56 UTC, 21 times: the text"));
  for (const char* state : {"FAULT", "IDLE", "CHECK", "MEASURE"}) {
    view.take(rig_state(state));
    EXPECT_THAT(texts(view), Contains(HasSubstr("ALARM"))) << state;
  }
  view.take(alarm("info", "acknowledged"));
  EXPECT_THAT(texts(view), Not(Contains(HasSubstr("ALARM"))));
}

TEST(LiveView, ForgetsTheCampaignBeforeWhenTheNextBegins) {
  LiveView view;
  view.take(rig_state("MEASURE"));
  view.take(estimate());
  view.take(alarm("warning", "parameter_change"));
  view.take(rig_state("IDLE"));
  EXPECT_THAT(texts(view), Contains(HasSubstr("theta0")));
  view.take(alarm("info", "warnings_set_aside"));
  view.take(rig_state("CHECK"));
  EXPECT_THAT(texts(view), Not(Contains(AnyOf(HasSubstr("theta0"), HasSubstr("warning")))));
}

TEST(LiveView, KeepsAPausedCampaignWhenItIsResumed) {
  LiveView view;
  view.take(rig_state("MEASURE"));
  view.take(estimate());
  view.take(rig_state("PAUSE"));
  view.take(rig_state("CHECK"));
  EXPECT_THAT(texts(view), Contains(HasSubstr("theta0")));
}

TEST(LiveView, SaysOfAnOlderAlarmItsDay) {
  LiveView view;
  view.take(alarm("error", "estop"));
  view.take({{"type", "health"}, {"t_utc", "2026-03-02T00:00:01.000Z"}});
  EXPECT_THAT(texts(view), Contains("ALARM since 2026-03-01 12:34:56 UTC: the text"));
}

TEST(LiveView, ShowsFiveAlarmsAndHowManyMoreThereAre) {
  LiveView view;
  for (int i = 0; i < 7; ++i)
    view.take(alarm("error", ("code" + std::to_string(i)).c_str()));
  EXPECT_THAT(texts(view), Contains(StartsWith("and 2 more: `shakerctl status`")));
}

// What an operator must see at once fits on the smallest terminal, whatever else there is.
TEST(LiveView, Of24LinesShowsStateAlarmsSetpointLimitsRunAndTheParameterKnownLeast) {
  LiveView view;
  view.take({{"type", "version"},
             {"program", "shakerd"},
             {"version", "1"},
             {"rig", "r"},
             {"limits",
              {{"stroke_min_m", 0.0},
               {"stroke_max_m", 0.3},
               {"stroke_rate_max_m_s", 3.0},
               {"excitation_max_m_s2", 15.0}}}});
  view.take(rig_state(
      "MEASURE", {{"frequency_hz", 2.0}, {"amplitude", 3.0}, {"progress", 0.5}, {"eta_s", 10}}));
  view.take({{"type", "run_start"},
             {"run", "slow"},
             {"run_index", 1},
             {"run_count", 4},
             {"cycles_wanted", 20}});
  for (int i = 0; i < 7; ++i)
    view.take(alarm("warning", ("code" + std::to_string(i)).c_str()));
  view.take({{"type", "cycle"},
             {"accepted", true},
             {"frequency_hz", 2.0},
             {"amplitude", 3.0},
             {"stroke_min_m", 0.06},
             {"stroke_max_m", 0.21},
             {"stroke_rate_m_s", 0.75}});
  Json many = estimate();
  many["parameters"][7]["standard_error"] = 0.25;
  view.take(many);
  const auto lines = texts(view);
  ASSERT_THAT(lines, SizeIs(24));
  EXPECT_THAT(lines, Contains("state MEASURE"));
  EXPECT_THAT(lines, Contains(StartsWith("warning since 12:34:56 UTC")));
  EXPECT_THAT(lines, Contains(StartsWith("setpoint 2 Hz, 3 m/s^2   measured 2 Hz, 3 m/s^2")));
  EXPECT_THAT(lines, Contains(StartsWith("run 2 of 4, slow")));
  EXPECT_THAT(lines, Contains("stroke [....==========......] 60.0 to 210.0 of 0 to 300 mm, "
                              "60.0 mm left"));
  EXPECT_THAT(lines, Contains("speed  [=====...............] 0.75 of 3 m/s, 75 % left"));
  EXPECT_THAT(lines, Contains("table  [====................] 3 of 15 m/s^2, 80 % left"));
  EXPECT_THAT(lines, Contains(StartsWith("known least: theta7 = 1.00 ± 0.25 m (25 %)")));
}

// An alarm whose remedy is cut off helps nobody; what must be seen at once is not pushed out for it.
TEST(LiveView, WrapsLongAlarmsAsFarAsThereIsRoom) {
  const std::string text =
      "Campaign walk was interrupted; /var/lib/shakerd/walk_20260301T123456Z.db holds 2 runs, "
      "all whole. `shakerctl run --resume "
      "/var/lib/shakerd/walk_20260301T123456Z.db` measures the rest.";
  LiveView view;
  view.take(rig_state("MEASURE", {{"frequency_hz", 2.0}, {"amplitude", 3.0}}));
  view.take(estimate());
  view.take(alarm("warning", "campaign_interrupted", text.c_str()));
  std::string shown;
  for (const auto& line : view.lines(80, 24)) {
    if (line.style == LiveView::Style::warning) shown += line.text.substr(shown.empty() ? 0 : 1);
  }
  EXPECT_EQ(shown, "warning since 12:34:56 UTC: " + text);
  for (int i = 0; i < 4; ++i)
    view.take(alarm("error", ("code" + std::to_string(i)).c_str(), (text + text + text).c_str()));
  EXPECT_THAT(view.lines(80, 24), SizeIs(24));
  EXPECT_THAT(texts(view), Contains(StartsWith("warning since 12:34:56 UTC: Campaign walk")));
  EXPECT_THAT(texts(view), Contains(StartsWith("setpoint 2 Hz, 3 m/s^2")));
  EXPECT_THAT(texts(view), Contains(StartsWith("known least:")));
}

TEST(LiveView, SaysBesideTheParameterKnownLeastThatIntervalsDoNotHold) {
  LiveView view;
  Json told = estimate();
  view.take(told);
  EXPECT_THAT(texts(view), Not(Contains(HasSubstr("INTERVALS"))));
  told["intervals_hold"] = false;
  view.take(told);
  EXPECT_THAT(texts(view), Contains(StartsWith("the values stand, the INTERVALS DO NOT")));
  told["usable"] = false;
  view.take(told);
  EXPECT_THAT(texts(view), Contains(StartsWith("NOT usable")));
}

TEST(LiveView, SaysWhichParameterIsNotDetermined) {
  LiveView view;
  Json some = estimate();
  for (auto& parameter : some["parameters"])
    parameter["determined"] = true;
  some["parameters"][3]["determined"] = false;
  view.take(some);
  EXPECT_THAT(texts(view), Contains("known least: theta3 is not determined by these cycles"));
}

TEST(LiveView, ShowsTheSetpointBesideWhatWasMeasuredAndNothingOfItAtRest) {
  LiveView view;
  const Json more = {{"frequency_hz", 2.0}, {"amplitude", 3.0}, {"progress", 0.5}, {"eta_s", 10}};
  view.take(rig_state("MEASURE", more));
  view.take({{"type", "run_start"},
             {"run", "slow"},
             {"run_index", 1},
             {"run_count", 4},
             {"frequency_hz", 2.0},
             {"amplitude", 3.0},
             {"cycles_wanted", 20}});
  view.take({{"type", "cycle"}, {"accepted", true}, {"frequency_hz", 2.0001}, {"amplitude", 2.95}});
  const auto moving = texts(view);
  EXPECT_THAT(moving, Contains("setpoint 2 Hz, 3 m/s^2   measured 2.0001 Hz, 2.95 m/s^2"));
  EXPECT_THAT(moving, Contains("run 2 of 4, slow: 1 of 20 cycles accepted, 0 left out"));
  view.take(rig_state("IDLE", more));
  for (const char* gone : {"setpoint", "ETA", "measured"})
    EXPECT_THAT(texts(view), Not(Contains(HasSubstr(gone)))) << gone;
}

TEST(LiveView, SaysWhichRunItIsToOneWhoConnectsInTheMiddleOfIt) {
  const Json version = {
      {"type", "version"}, {"program", "shakerd"}, {"version", "1"}, {"rig", "r"}};
  const auto in_run = [](int index, const char* run) {
    return rig_state("SETTLE", {{"run", run}, {"run_index", index}, {"run_count", 3}});
  };
  LiveView view;
  view.take(version);
  view.take(in_run(1, "fast"));
  EXPECT_THAT(texts(view), Contains("run 2 of 3, fast"));
  view.take({{"type", "cycle"}, {"accepted", true}});
  EXPECT_THAT(texts(view), Contains("run 2 of 3, fast"));
  view.take({{"type", "run_start"},
             {"run", "mid"},
             {"run_index", 2},
             {"run_count", 3},
             {"cycles_wanted", 10}});
  view.take(in_run(2, "mid"));
  EXPECT_THAT(texts(view), Contains("run 3 of 3, mid: 0 of 10 cycles accepted, 0 left out"));
  view.take(version);  // it connects again, and does not know what it has missed
  view.take(in_run(2, "mid"));
  EXPECT_THAT(texts(view), Contains("run 3 of 3, mid"));
}

TEST(LiveView, SaysFirstThatTheDaemonIsGone) {
  LiveView view;
  view.take(rig_state("MEASURE"));
  view.set_lost("nobody listens");
  EXPECT_THAT(texts(view).front(), StartsWith("NO CONNECTION: nobody listens"));
  view.take(rig_state("IDLE"));
  EXPECT_THAT(texts(view), Not(Contains(HasSubstr("NO CONNECTION"))));
}

}  // namespace
}  // namespace shaker::cli
