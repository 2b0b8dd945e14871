// Dampers on dynamometers: what does a viscous model of them lack? Forces are taken per reference
// mass, so that the catalogue's ranges mean something.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/csv.hpp"
#include "estimator/discrepancy/diagnose.hpp"

namespace shaker::estimator::discrepancy {
namespace {

std::filesystem::path data_folder() {
  const char* said = std::getenv("SHAKER_REAL_DATA");
  return said != nullptr ? said : SHAKER_REAL_DATA;
}

struct Run {
  std::string file;
  double frequency_hz;
};

Campaign dynamometer(const std::string& folder, const std::vector<Run>& runs,
                     const std::string& force, double per_mass) {
  Campaign campaign;
  campaign.name = folder;
  for (const Run& run : runs) {
    const auto table =
        cli::read_csv(data_folder() / folder / run.file, {{"time_s", "displacement_mm", force}});
    EXPECT_TRUE(table) << table.error().what;
    if (!table) continue;
    Recording r;
    r.name = run.file;
    r.kind = Kind::imposed_motion;
    r.frequency_hz = run.frequency_hz;
    r.t = table->columns.at("time_s");
    for (const double u : table->columns.at("displacement_mm"))
      r.displacement.push_back(1e-3 * u);
    for (const double f : table->columns.at(force))
      r.force.push_back(f * per_mass);
    campaign.runs.push_back(std::move(r));
  }
  return campaign;
}

config::ModelSpec viscous() {
  config::ModelSpec spec;
  spec.name = "viscous";
  config::EffectSpec damper;
  damper.effect = "viscous_damping";
  spec.effects.push_back(damper);
  return spec;
}

std::vector<std::string> names(const Diagnosis& d) {
  std::vector<std::string> list;
  for (const NamedEffect& e : d.effects)
    list.push_back(e.name);
  return list;
}

void print(const Diagnosis& d) {
  std::printf("%s: gap %.4g -> %.4g, noise floor %.3g;", name(d.verdict), d.gap.before, d.gap.after,
              d.gap.noise_floor);
  for (const NamedEffect& e : d.effects)
    std::printf(" %s %.2f", e.name.c_str(), e.probability);
  std::printf("\n");
  for (std::size_t i = 0; i < d.ranking.size() && i < 6; ++i)
    std::printf("  %-22s gain %.3g refitted %.3g %s\n", d.ranking[i].name.c_str(),
                d.ranking[i].gain, d.ranking[i].gain_refitted.value_or(0.0),
                d.ranking[i].disqualified.c_str());
  for (const RunGap& r : d.runs)
    std::printf("  %-24s %3d cycles, gap %.4g -> %.4g, noise floor %.3g\n", r.name.c_str(),
                r.cycles, r.before, r.after, r.noise_floor);
  for (const std::string& warning : d.warnings)
    std::printf("  %s\n", warning.c_str());
}

class RealDynamometer : public ::testing::Test {
 protected:
  void SetUp() override {
    if (data_folder().empty() || !std::filesystem::is_directory(data_folder()))
      GTEST_SKIP() << "SHAKER_REAL_DATA names no folder of real measurements";
  }
};

TEST_F(RealDynamometer, MagnetoRheologicalDamperRanksFrictionAndHysteresisFirst) {
  const auto d = diagnose(dynamometer("mr_damper_utfsm",
                                      {{"mr_2mm5Hz0A.csv", 5.0},
                                       {"mr_5mm3Hz0A.csv", 3.0},
                                       {"mr_10mm1Hz0A.csv", 1.0},
                                       {"mr_25mm0p5Hz0A.csv", 0.5},
                                       {"mr_25mm0p25Hz0A.csv", 0.25}},
                                      "force_N", 0.01),
                          viscous());
  ASSERT_TRUE(d) << d.error().what;
  print(*d);
  EXPECT_NE(d->verdict, Verdict::adequate);
  // Nothing that the catalogue holds explains it better than friction or hysteresis.
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_THAT(d->ranking[i].name, ::testing::AnyOf("coulomb_friction", "stribeck_friction",
                                                     "presliding_friction", "bouc_wen_hysteresis"));
}

TEST_F(RealDynamometer, BandedFrictionDamperLacksFrictionThatGives) {
  const auto d = diagnose(dynamometer("friction_backlash_brfd",
                                      {{"ds2_36lb_0.25Hz_0.5in.csv", 0.25},
                                       {"ds2_36lb_0.25Hz_1in.csv", 0.25},
                                       {"ds2_36lb_0.25Hz_1.5in.csv", 0.25},
                                       {"ds2_36lb_0.5Hz_1in.csv", 0.5},
                                       {"ds2_36lb_0.5Hz_1.5in.csv", 0.5}},
                                      "force_kN", 0.1),
                          viscous());
  ASSERT_TRUE(d) << d.error().what;
  print(*d);
  EXPECT_NE(d->verdict, Verdict::adequate);
  EXPECT_THAT(names(*d),
              ::testing::Contains(::testing::AnyOf("presliding_friction", "bouc_wen_hysteresis")));
  EXPECT_LT(d->gap.after, 0.5 * d->gap.before);
}

}  // namespace
}  // namespace shaker::estimator::discrepancy
