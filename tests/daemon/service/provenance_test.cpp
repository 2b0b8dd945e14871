#include "daemon/service/provenance.hpp"

#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRigText = R"({"name": "r", "model": "m.json",
  "exciter": {"device": {"kind": "can", "interface": "can0", "dbc": "drive.dbc",
                         "setpoint_message": "S", "status_message": "T"}},
  "sensors": [{"kind": "can", "interface": "can0", "dbc": "drive.dbc",
               "signals": [{"channel": "displacement", "message": "M", "signal": "u"}]}],
  "calibration": {"displacement": {"sensor": "LVDT", "serial": "L-1", "date": "2026-01-12",
                                   "due": "2027-01-12", "uncertainty": 0.02, "unit": "mm"}},
  "limits": {"stroke_max_m": 0.25}})";

class Provenance : public ::testing::Test {
 protected:
  void write(const char* name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  std::vector<record::Fact> facts() {
    write("rig.json", kRigText);
    const auto rig = config::load_rig(folder_ / "rig.json");
    EXPECT_TRUE(rig) << rig.error().what;
    return facts_of_rig(*rig, folder_ / "rig.json");
  }
  static std::string value_of(const std::vector<record::Fact>& facts, const std::string& kind,
                              const std::string& name) {
    const auto found = std::ranges::find_if(facts, [&](const record::Fact& fact) {
      return fact.kind == kind && (name.empty() || fact.name == name);
    });
    return found == facts.end() ? "(missing)" : found->value;
  }

  record::testing::Scratch scratch_;
  const std::filesystem::path folder_ = scratch_.path();
};

TEST_F(Provenance, HoldsTheRigFileAndEachFileThatItNamesOnce) {
  write("m.json", "{the model}");
  write("drive.dbc", "VERSION \"\"\n");
  const auto all = facts();
  EXPECT_EQ(value_of(all, "rig file", folder_ / "rig.json"), kRigText);
  EXPECT_EQ(value_of(all, "model file", folder_ / "m.json"), "{the model}");
  EXPECT_EQ(value_of(all, "DBC file", folder_ / "drive.dbc"), "VERSION \"\"\n");
  EXPECT_EQ(std::ranges::count(all, "DBC file", &record::Fact::kind), 1);
}

TEST_F(Provenance, SaysOfAFileThatCannotBeReadWhyNot) {
  EXPECT_THAT(value_of(facts(), "DBC file", ""), HasSubstr("not read: "));
}

TEST_F(Provenance, HoldsTheLimitsInForceAndTheSensorsInSiUnits) {
  const auto all = facts();
  const auto limits = nlohmann::json::parse(value_of(all, "limits", "in force"));
  EXPECT_EQ(limits["stroke_max_m"], 0.25);
  EXPECT_EQ(limits["stroke_rate_max_m_s"], 3.0) << "a default";
  EXPECT_EQ(limits["excitation_action"], "ramp_down");
  const auto sensor = nlohmann::json::parse(value_of(all, "sensor", "displacement"));
  EXPECT_EQ(sensor["serial"], "L-1");
  EXPECT_EQ(sensor["due"], "2027-01-12");
  EXPECT_DOUBLE_EQ(sensor["uncertainty"].get<double>(), 2e-5);
  EXPECT_EQ(sensor["unit"], "m");
}

TEST_F(Provenance, HoldsTheProgramsAndTheHost) {
  const auto all = facts();
  EXPECT_EQ(value_of(all, "program", "shakerd"), SHAKER_TESTED_VERSION);
  for (const char* program : {"compiler", "sqlite", "kernel"})
    EXPECT_NE(value_of(all, "program", program), "(missing)") << program;
  EXPECT_NE(value_of(all, "host", "name"), "(missing)");
}

}  // namespace
}  // namespace shaker::daemon
