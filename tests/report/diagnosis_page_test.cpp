#include "report/diagnosis_page.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "report/diagnosis_document.hpp"
#include "report/diagnosis_pictures.hpp"

namespace shaker::report {
namespace {

using namespace estimator::diagnosis;
using ::testing::HasSubstr;
using ::testing::Not;

Diagnosis friction_found() {
  Diagnosis d;
  d.verdict = Verdict::explained;
  d.campaign = "left <main> gear";
  d.model = "oleo";
  d.improved.length_unit = "m";
  d.gap = {8e-6, 1e-5, 1e-4, 1.1e-5, 2e-4, 1.2e-5, "m"};
  d.runs = {{"r01", Role::fit, 2.0, 3.0, 14, 1e-4, 1.1e-5, 8e-6, 1e-5},
            {"r02", Role::held_out, 3.0, 4.0, 14, 2e-4, 1.2e-5, 8e-6, 1e-5}};
  NamedEffect effect;
  effect.name = "coulomb_friction";
  effect.meaning = "dry friction of the seals";
  effect.formula = "f_c tanh(v / e)";
  effect.probability = 0.998;
  estimator::ParameterEstimate level;
  level.name = "f_c";
  level.unit = "m/s^2";
  level.value = 0.2;
  level.standard_error = 0.001;
  level.lower = 0.198;
  level.upper = 0.202;
  effect.parameters = {level};
  effect.confusable_with = {"presliding_friction"};
  effect.discriminating_run = DiscriminatingRun{1.0, 0.5, "", 4.0};
  d.effects = {effect};
  RunCurves curves;
  curves.name = "r01";
  for (int i = 0; i < 40; ++i) {
    const double angle = 2 * M_PI * i / 40;
    curves.measured.push_back(0.16 + 0.01 * std::cos(angle));
    curves.before.push_back(0.16 + 0.0101 * std::cos(angle));
    curves.after.push_back(0.16 + 0.01 * std::cos(angle));
    curves.stroke.push_back(0.16 + 0.01 * std::cos(angle));
    curves.velocity.push_back(-0.12 * std::sin(angle));
    curves.velocity_before.push_back(-0.13 * std::sin(angle));
    curves.velocity_after.push_back(-0.12 * std::sin(angle));
    curves.force_before.push_back(std::sin(angle) > 0 ? -0.2 : 0.2);
    curves.force_after.push_back(0.0);
  }
  d.curves = {curves};
  d.location.words = "at velocity reversal: 71 % of the gap";
  d.ranking = {{"coulomb_friction", 900.0, 0.3, 0.998, 905.0, {}, ""}};
  d.false_alarm_rate = 0.01;
  return d;
}

TEST(DiagnosisPage, BeginsWithWhatWasMissing) {
  const Diagnosis d = friction_found();
  EXPECT_EQ(diagnosis_sentence(d),
            "coulomb_friction was missing: with it the gap shrinks from 10 to 1.1 times the noise "
            "floor.");
  const std::string page = diagnosis_page(d);
  EXPECT_THAT(page, HasSubstr("left &lt;main&gt; gear"));
  EXPECT_THAT(page, HasSubstr("presliding_friction"));
  EXPECT_THAT(page, HasSubstr("one more run at 1 Hz with an amplitude of 0.5 m/s²"));
  EXPECT_THAT(page, HasSubstr("f_c = 0.2000 ± 0.0010 m/s^2"));
  EXPECT_THAT(page, HasSubstr("at velocity reversal"));
}

TEST(DiagnosisPage, SaysHowSureAKindOfEffectsIs) {
  Diagnosis d = friction_found();
  d.kinds = {{"dry friction", 0.6, {{"coulomb_friction", 0.35}, {"presliding_friction", 0.25}}}};
  constexpr const char* kSentence =
      "dry friction, probability 0.60 (coulomb_friction 0.35, presliding_friction 0.25)";
  EXPECT_THAT(diagnosis_page(d), HasSubstr(kSentence));
  EXPECT_EQ(diagnosis_table(d).find("explained: missing is " + std::string(kSentence)), 0U);
  EXPECT_THAT(diagnosis_json(d), HasSubstr("\"kinds\""));
  EXPECT_THAT(diagnosis_json(friction_found()), Not(HasSubstr("\"kinds\"")));
}

// The cells are over the stroke, whatever is measured: with an imposed motion that is a force.
TEST(DiagnosisPage, MapsTheMissingForceOverTheStroke) {
  Diagnosis d = friction_found();
  for (double& force : d.curves[0].measured)
    force = -9.0 + 100.0 * force;
  EXPECT_EQ(force_map(d, false), force_map(friction_found(), false));
  EXPECT_THAT(force_map(d, false), HasSubstr("Missing force over stroke and velocity"));
}

// A load cell or an imposed motion has no phase plane.
// 0.2000 ± 0.0010 with an interval of "0.2 to 0.2" would be no interval.
TEST(DiagnosisPage, RoundsAnIntervalByTheStandardError) {
  Diagnosis d = friction_found();
  d.effects[0].parameters[0].lower = 0.19804;
  d.effects[0].parameters[0].upper = 0.20196;
  d.effects[0].parameters[0].standard_error = 0.00001;
  EXPECT_THAT(diagnosis_page(d), HasSubstr("(95 %: 0.198040 to 0.201960)"));
}

TEST(DiagnosisPage, HasATitleBlock) {
  const std::string page =
      diagnosis_page(friction_found(), {{"rig", "bench <2>"}, {"specimen", ""}});
  EXPECT_THAT(page, HasSubstr("<th>model</th><td>oleo</td>"));
  EXPECT_THAT(page, HasSubstr("<th>rig</th><td>bench &lt;2&gt;</td>"));
  EXPECT_THAT(page, Not(HasSubstr("specimen")));
}

TEST(DiagnosisPage, DrawsThePhasePlaneWhereAMotionIsPredicted) {
  Diagnosis d = friction_found();
  EXPECT_THAT(diagnosis_page(d), HasSubstr("Run r01: phase plane"));
  d.curves[0].velocity_before.clear();
  EXPECT_THAT(diagnosis_page(d), Not(HasSubstr("phase plane")));
  EXPECT_THAT(diagnosis_page(d), HasSubstr("missing force along the motion"));
}

TEST(DiagnosisPage, SaysTheAmplitudesUnit) {
  Diagnosis d = friction_found();
  EXPECT_THAT(diagnosis_page(d), HasSubstr(">amplitude, m/s²</th>"));
  EXPECT_THAT(diagnosis_table(d), HasSubstr("with amplitude 0.5 m/s^2 "));
  d.gap.unit = "m/s^2";  // the motion was imposed
  EXPECT_THAT(diagnosis_page(d), HasSubstr(">amplitude, mm</th>"));
  EXPECT_THAT(diagnosis_page(d), HasSubstr("with an amplitude of 500 mm"));
  EXPECT_THAT(diagnosis_table(d), HasSubstr("with amplitude 500 mm "));
}

TEST(DiagnosisPage, FoldsFurtherRunsOnTheScreenAndNotOnPaper) {
  Diagnosis d = friction_found();
  for (const char* name : {"r02", "r03", "r04"}) {
    d.curves.push_back(d.curves.front());
    d.curves.back().name = name;
  }
  const std::string page = diagnosis_page(d);
  EXPECT_THAT(page, HasSubstr("<details><summary>The other runs"));
  const std::string print = page.substr(page.find("@media print"));
  EXPECT_THAT(print.substr(0, print.find('\n')),
              HasSubstr("details::details-content{content-visibility:visible}"));
}

TEST(DiagnosisPage, StandsAlone) {
  const std::string page = diagnosis_page(friction_found());
  for (const char* outside : {"src=", "href=", "@import", "<script", "url("})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
}

TEST(DiagnosisPage, SaysNothingIsMissingAndDrawsNoForce) {
  Diagnosis d = friction_found();
  d.verdict = Verdict::adequate;
  d.effects.clear();
  d.ranking.clear();
  d.gap.before = 1.02e-5;
  d.probability_before = 0.4;
  const std::string page = diagnosis_page(d);
  EXPECT_THAT(page, HasSubstr("Nothing is missing: the gap is 1.02 times the noise floor"));
  EXPECT_THAT(page, Not(HasSubstr("Where the missing force lies")));
}

// No effect of the catalogue is passed by without a word.
TEST(DiagnosisPage, NamesWhatWasNotTriedAndWhy) {
  Diagnosis d = friction_found();
  EXPECT_THAT(diagnosis_page(d), Not(HasSubstr("What was not tried")));
  EXPECT_THAT(diagnosis_table(d), Not(HasSubstr("not tried")));
  EXPECT_THAT(diagnosis_json(d), HasSubstr("\"not_tried\": []"));
  d.not_tried = {{"metering_pin", "it changes an orifice"},
                 {"relief_valve", "it changes an orifice"},
                 {"free_play", "the model with it has no motion", true}};
  const std::string page = diagnosis_page(d);
  EXPECT_THAT(page, HasSubstr("What was not tried"));
  EXPECT_THAT(page, HasSubstr("<td>metering_pin</td><td>it changes an orifice</td>"));
  EXPECT_THAT(diagnosis_table(d),
              HasSubstr("\nnot tried: free_play: the model with it has no motion\n"
                        "not tried: metering_pin, relief_valve: it changes an orifice\n"));
  const auto all = nlohmann::json::parse(diagnosis_json(d)).at("not_tried");
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].at("name"), "metering_pin");
  EXPECT_EQ(all[0].at("reason"), "it changes an orifice");
  EXPECT_EQ(all[0].at("failed"), false);
  EXPECT_EQ(all[2].at("failed"), true);
}

TEST(DiagnosisPage, SaysOfAnAdequateModelWhatCouldNotBeComputed) {
  Diagnosis d = friction_found();
  d.verdict = Verdict::adequate;
  d.effects.clear();
  d.not_tried = {{"metering_pin", "it changes an orifice"}};
  EXPECT_THAT(diagnosis_sentence(d), Not(HasSubstr("could not be computed")));
  EXPECT_THAT(diagnosis_table(d), HasSubstr("nothing is missing that these data could show"));
  d.not_tried.push_back({"free_play", "the model with it has no motion", true});
  EXPECT_THAT(diagnosis_sentence(d),
              ::testing::EndsWith("But what could not be computed may be: free_play."));
  EXPECT_THAT(diagnosis_table(d), HasSubstr("nothing is missing of what could be computed"));
}

TEST(DiagnosisPage, SaysWhatItDoesNotKnow) {
  Diagnosis d = friction_found();
  d.verdict = Verdict::unexplained;
  EXPECT_THAT(diagnosis_sentence(d), HasSubstr("coulomb_friction helps most, but a gap of 1.1"));
  d.effects.clear();
  EXPECT_THAT(diagnosis_sentence(d), HasSubstr("no effect of the catalogue explains"));
}

TEST(DiagnosisPage, ShowsTheShapeOfWhatStaysUnexplained) {
  Diagnosis d = friction_found();
  EXPECT_THAT(diagnosis_page(d), Not(HasSubstr("within its uncertainty")));
  d.verdict = Verdict::unexplained;
  d.remaining =
      RemainingForce{"remaining force, up to 0.3 m/s^2 on extension", 0.9, 1e-3, 0.01, {}};
  for (int i = 0; i < 20; ++i)
    d.remaining->cells.push_back({1e-3 * i, 0.01 * i - 0.1, i < 10 ? 0.3 : 0.01, 0.02, 0.05});
  const std::string page = diagnosis_page(d);
  EXPECT_THAT(page, HasSubstr("remaining force, up to 0.3 m/s^2 on extension"));
  EXPECT_THAT(page, HasSubstr("within its uncertainty"));
  EXPECT_THAT(page, HasSubstr("<circle"));
  EXPECT_THAT(diagnosis_json(d), HasSubstr("\"remaining_force\""));
  EXPECT_THAT(diagnosis_table(d), HasSubstr("remaining force, up to 0.3"));
}

}  // namespace
}  // namespace shaker::report
