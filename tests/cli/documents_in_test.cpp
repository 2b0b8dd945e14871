#include "cli/documents_in.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/terminal.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

TEST(DocumentsIn, ReadBackWhatTheProtocolWrote) {
  protocol::EstimateDocument sent;
  sent.campaign = "c";
  sent.cycle = 7;
  sent.model = "oleo";
  sent.parameters = {{"theta1", "orifice_damping", "1/m", 16.5, 0.5, 15.5, 17.5, false, true, true},
                     {"theta2", "gas_spring", "m/s^2", 2.0, std::nan(""), std::nan(""),
                      std::nan(""), false, false, false}};
  sent.noise_standard_deviation = 2e-5;
  sent.condition = 12.0;
  sent.observations = 64;
  sent.degrees_of_freedom = 62;
  sent.cycles_used = 3;
  sent.runs_used = 2;
  sent.converged = true;
  sent.intervals_hold = false;
  sent.warnings = {"theta2 is undetermined"};
  const auto got = estimate_from(Json::parse(protocol::to_json_line(sent, {})));
  EXPECT_EQ(got.campaign, "c");
  EXPECT_EQ(got.cycle, 7);
  ASSERT_EQ(got.parameters.size(), 2u);
  EXPECT_EQ(got.parameters[0].standard_error, 0.5);
  EXPECT_EQ(got.parameters[0].upper, 17.5);
  EXPECT_TRUE(got.parameters[0].at_bound);
  EXPECT_TRUE(std::isnan(got.parameters[1].standard_error));
  EXPECT_FALSE(got.parameters[1].determined);
  EXPECT_EQ(got.observations, 64);
  EXPECT_EQ(got.cycles_used, 3);
  EXPECT_EQ(got.runs_used, 2);
  EXPECT_TRUE(got.converged);
  EXPECT_FALSE(got.usable);
  EXPECT_FALSE(got.intervals_hold);
  EXPECT_TRUE(estimate_from(Json::object()).intervals_hold) << "an older daemon does not say";
  EXPECT_THAT(got.warnings, testing::ElementsAre("theta2 is undetermined"));
}

TEST(DocumentsIn, NarrateEachKindInOneLine) {
  const auto line = [](const protocol::Document& document) {
    return narrate(Json::parse(protocol::to_json_line(document, {})));
  };
  EXPECT_EQ(line(protocol::RunStartDocument{"c", "slow", 0, 2, 1.5, 2.0, 20}),
            "run 1 of 2, slow: 1.5 Hz, 2 m/s^2, 20 cycles");
  EXPECT_EQ(line(protocol::RunStopDocument{"c", "slow", "fail", "no steady state", 0, 200}),
            "run slow: fail (0 cycles accepted, 200 left out): no steady state");
  protocol::CycleDocument cycle;
  cycle.run = "slow";
  cycle.cycle = 4;
  cycle.why = "transient";
  cycle.frequency_hz = 1.5;
  cycle.amplitude = 2.0;
  cycle.stroke_min_m = 0.05;
  cycle.stroke_max_m = 0.17;
  EXPECT_EQ(line(cycle),
            "cycle 4 of slow left out (transient): 1.5 Hz, 2 m/s^2, stroke 50.0 to 170.0 mm");
  EXPECT_EQ(line(protocol::AlarmDocument{"error", "stale", "No sample.", "ramp_down", {}, {}, {}}),
            "error: No sample. (action: ramp_down)");
  EXPECT_EQ(line(protocol::HealthDocument{}), "");
  protocol::StateDocument state;
  state.state = "IDLE";
  EXPECT_EQ(line(state), "state IDLE");
  state.unprotected = true;
  EXPECT_EQ(line(state), "state IDLE (UNPROTECTED: no detector ends the motion)");
}

TEST(DocumentsIn, LetNothingSteerTheTerminal) {
  EXPECT_EQ(narrate(Json{{"type", "state"},
                         {"state", "ID\x1b[2JLE\n"},
                         {"reason",
                          "\xc2\x9b"
                          "x"}}),
            "state ID [2JLE :   x");
}

TEST(DocumentsIn, SurviveOtherTypesThanExpected) {
  EXPECT_EQ(narrate(Json::array()), "a line that is not a document");
  EXPECT_EQ(narrate(Json{{"type", 5}}), "");
  EXPECT_EQ(narrate(Json{{"type", "state"}, {"state", 5}}), "state ");
  const auto estimate = estimate_from(
      Json{{"parameters", {1, "x", {{"interval", {1}}}}}, {"warnings", 3}, {"cycles_used", 1.5}});
  EXPECT_EQ(estimate.parameters.size(), 1u);
  EXPECT_EQ(estimate.cycles_used, 0);
}

TEST(Terminal, ClipsByCharactersAndBoundsTheBar) {
  EXPECT_EQ(clipped("a±b", 2), "a±");
  EXPECT_EQ(clipped("ab", 5), "ab");
  EXPECT_EQ(progress_bar(0.5, 4), "[##..]  50 %");
  EXPECT_EQ(progress_bar(7.0, 4), "[####] 100 %");
  EXPECT_EQ(progress_bar(std::nan(""), 4), "[....]   0 %");
}

}  // namespace
}  // namespace shaker::cli
