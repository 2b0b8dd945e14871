#include "base/unit.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace shaker {
namespace {

using ::testing::HasSubstr;

// The values and digits that NIST Special Publication 811 (2008), appendix B.8, prints.
TEST(Unit, HasTheSizeThatIsPrinted) {
  struct Printed {
    const char* name;
    double value, si, digits;
  };
  for (const Printed& p :
       {Printed{"in", 1, 2.54e-2, 0}, Printed{"ft", 1, 3.048e-1, 0}, Printed{"g", 1, 9.80665, 0},
        Printed{"lbf", 1, 4.448222, 1e-6}, Printed{"psi", 1, 6.894757e3, 1e-3},
        Printed{"lbf/ft^2", 1, 4.788026e1, 1e-5}, Printed{"kgf", 1, 9.80665, 0},
        Printed{"atm", 1, 1.01325e5, 0}, Printed{"bar", 1, 1e5, 0},
        Printed{"deg", 1, 1.745329e-2, 1e-8}, Printed{"rpm", 60, 1.0, 0},
        Printed{"rad/s", 6.283185307, 1.0, 1e-9}, Printed{"km/h", 3.6, 1.0, 0},
        Printed{"degC", 20, 293.15, 0}, Printed{"degF", 68, 293.15, 0},
        Printed{"degF", -40, 233.15, 0}, Printed{"ms", 1, 1e-3, 0}}) {
    const auto unit = unit_called(p.name);
    ASSERT_TRUE(unit) << p.name;
    EXPECT_NEAR(unit->to_si(p.value), p.si, p.digits + 1e-12 * std::fabs(p.si)) << p.name;
    EXPECT_NEAR(unit->from_si(unit->to_si(p.value)), p.value, 1e-12 * std::fabs(p.value)) << p.name;
  }
}

TEST(Unit, IsKnownInTheSpellingsOfDeviceFiles) {
  for (const char* name : {"m/s2", "m/s²", "m/s/s"})
    EXPECT_EQ(unit_called(name)->name, "m/s^2");
  EXPECT_EQ(unit_called("µm")->name, "um");
  EXPECT_EQ(unit_called("°C")->name, "degC");
}

TEST(Unit, OfAnotherDimensionOrNoneIsRefusedWithTheList) {
  EXPECT_FALSE(unit_called("furlong"));
  EXPECT_FALSE(unit_called(""));
  EXPECT_FALSE(unit_called("G"));  // it could be gauss
  EXPECT_FALSE(unit_called("mm", Dimension::acceleration));
  EXPECT_TRUE(unit_called("g", Dimension::acceleration));
  EXPECT_EQ(units_of(Dimension::length), "m, cm, mm, um, in, ft");
  EXPECT_THAT(units_of(Dimension::acceleration), HasSubstr("ft/s^2, g"));
  EXPECT_EQ(si_unit(Dimension::frequency), "Hz");
}

}  // namespace
}  // namespace shaker
