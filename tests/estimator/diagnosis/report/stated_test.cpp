// What a model file states, in the improved model and in the hypothesis that leads.
#include "estimator/diagnosis/report/internal/stated.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

config::EffectSpec stop(double width, double place) {
  config::EffectSpec line;
  line.effect = "end_stop";
  line.constants["w"] = width;
  line.parameters["u_s"].start = place;
  return line;
}

// The model file holds one stop whose width it states; a diagnosis has found a second one.
Diagnosis found() {
  Diagnosis said;
  said.improved.length_unit = "m";
  said.improved.effects = {stop(1e-3, 0.10), stop(1e-3, 0.15)};  // as wide as the catalogue has it
  said.damper.hypotheses.resize(2);
  for (auto& hypothesis : said.damper.hypotheses)
    hypothesis.model.effects = {stop(2e-5, 0.10), stop(2e-5, 0.15)};  // as fitted: to no width
  return said;
}

TEST(Stated, TheLeadingHypothesisKeepsTheNarrowCornersThatItWasFittedWith) {
  config::ModelSpec file;
  file.length_unit = "m";
  file.effects = {stop(4e-3, 0.12)};
  Diagnosis said = found();
  hold_against_file(file, said);
  EXPECT_EQ(said.improved.effects[0].constants.at("w"), 4e-3);
  EXPECT_EQ(said.improved.effects[1].constants.at("w"), 1e-3);
  const auto& lines = said.damper.hypotheses[0].model.effects;
  EXPECT_EQ(lines[0].constants.at("w"), 4e-3);
  EXPECT_EQ(lines[1].constants.at("w"), 2e-5);
  EXPECT_EQ(lines[1].parameters.at("u_s").start, 0.15);
}

TEST(Stated, ADiagnosisWithoutHypothesesIsLeftAsItIs) {
  Diagnosis said = found();
  said.damper.hypotheses.clear();
  hold_against_file({}, said);
  EXPECT_TRUE(said.damper.hypotheses.empty());
}

// The catalogue's bounds follow the motion.
TEST(Stated, AModelInMillimetresIsAsGoodAsOneInMetres) {
  config::ModelSpec file;
  file.length_unit = "mm";
  file.effects = {stop(2e-5, 0.12)};
  Diagnosis said = found();
  hold_against_file(file, said);
  EXPECT_TRUE(said.warnings.empty());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
