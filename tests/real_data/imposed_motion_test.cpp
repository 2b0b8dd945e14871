// Dampers on dynamometers: what does a viscous model of them lack? Forces are per reference
// mass, so that the ranges of the catalogue apply.
#include "tests/real_data/measured.hpp"

namespace shaker::estimator::diagnosis::testing {
namespace {

struct Run {
  std::string file;
  double frequency_hz = 0.0;  // 0: without a period
  Role role = Role::fit;
};

Campaign dynamometer(const std::string& folder, const std::vector<Run>& runs,
                     const std::string& force, double per_mass) {
  Campaign campaign;
  campaign.name = folder;
  for (const Run& run : runs) {
    const auto table = table_of(folder + "/" + run.file, {{"displacement_mm"}, {force}});
    if (table.columns.empty()) continue;
    Recording r;
    r.name = run.file;
    r.kind = Kind::imposed_motion;
    r.role = run.role;
    r.frequency_hz = run.frequency_hz;
    r.t = take(table, {"time_s"});
    r.displacement = take(table, {"displacement_mm", 1e-3});
    r.force = take(table, {force, per_mass});
    campaign.runs.push_back(std::move(r));
  }
  return campaign;
}

config::ModelSpec viscous() {
  config::ModelSpec spec;
  spec.name = "viscous";
  spec.effects.push_back(line("viscous_damping", "c", 5.0, 0.0, 1e3));
  spec.effects.push_back(offset_force());
  return spec;
}

Diagnosis diagnosed(const Campaign& campaign) {
  const auto d = diagnose(campaign, viscous());
  EXPECT_TRUE(d) << d.error().what;
  if (!d) return {};
  print(*d);
  return *d;
}

class RealDynamometer : public RealData {};

TEST_F(RealDynamometer, MagnetoRheologicalDamperLacksHysteresis) {
  const auto d = diagnosed(dynamometer("mr_damper_utfsm",
                                       {{"mr_2mm5Hz0A.csv", 5.0},
                                        {"mr_5mm3Hz0A.csv", 3.0},
                                        {"mr_10mm1Hz0A.csv", 1.0},
                                        {"mr_25mm0p5Hz0A.csv", 0.5},
                                        {"mr_25mm0p25Hz0A.csv", 0.25}},
                                       "force_N", 0.01));
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  ASSERT_FALSE(d.effects.empty());
  // Hysteresis, either with Dahl's two parameters or with the four of Bouc-Wen, which include
  // them.
  EXPECT_THAT(d.effects[0].name, ::testing::AnyOf("presliding_friction", "bouc_wen_hysteresis"));
  EXPECT_LT(d.gap.after, 0.4 * d.gap.before);
}

TEST_F(RealDynamometer, MagnetoRheologicalDamperWithCurrentLacksHysteresis) {
  const auto d = diagnosed(dynamometer("mr_damper_utfsm",
                                       {{"mr_2mm5Hz0p5A.csv", 5.0},
                                        {"mr_5mm3Hz0p5A.csv", 3.0},
                                        {"mr_10mm1Hz0p5A.csv", 1.0},
                                        {"mr_25mm0p5Hz0p5A.csv", 0.5},
                                        {"mr_25mm0p25Hz0p5A.csv", 0.25}},
                                       "force_N", 0.004));
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  ASSERT_FALSE(d.effects.empty());
  // Hysteresis, either with Dahl's two parameters or with the four of Bouc-Wen, which include
  // them.
  EXPECT_THAT(d.effects[0].name, ::testing::AnyOf("presliding_friction", "bouc_wen_hysteresis"));
  EXPECT_LT(d.gap.after, 0.3 * d.gap.before);
}

TEST_F(RealDynamometer, BandedFrictionDamperLacksFrictionThatGivesThenFreePlay) {
  const auto d = diagnosed(dynamometer("friction_backlash_brfd",
                                       {{"ds2_36lb_0.25Hz_0.5in.csv", 0.25},
                                        {"ds2_36lb_0.25Hz_1in.csv", 0.25},
                                        {"ds2_36lb_0.25Hz_1.5in.csv", 0.25},
                                        {"ds2_36lb_0.5Hz_1in.csv", 0.5},
                                        {"ds2_36lb_0.5Hz_1.5in.csv", 0.5}},
                                       "force_kN", 0.1));
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].name, "presliding_friction");
  EXPECT_LT(d.gap.after, 0.2 * d.gap.before);
  ASSERT_GE(d.effects.size(), 2U);
  EXPECT_EQ(d.effects[1].name, "free_play");
}

}  // namespace
}  // namespace shaker::estimator::diagnosis::testing
