#include "report/text_table.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "report/estimate_table.hpp"

namespace shaker::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(TextTable, AlignsByCharactersNotBytes) {
  EXPECT_EQ(text_table({{"a", "value"}, {"long", "1 ± 2"}, {"b", "-"}}, {false, true}),
            "a     value\n"
            "----  -----\n"
            "long  1 ± 2\n"
            "b         -\n");
}

TEST(TextTable, RoundsAValueByItsError) {
  EXPECT_EQ(with_error(16.67123, 0.0243), "16.671 ± 0.024");
  EXPECT_EQ(with_error(-16.67123, 2.43), "-16.7 ± 2.4");
  EXPECT_EQ(with_error(1234.5, 56.0), "1234 ± 56");
  EXPECT_EQ(with_error(1.0, 0.00012), "1.00000 ± 0.00012");
  EXPECT_EQ(with_error(2e-5, 1e-6), "2.00e-05 ± 1.0e-06");
  EXPECT_EQ(with_error(3.25e7, 1e5), "3.250e+07 ± 1.0e+05");
  EXPECT_EQ(with_error(5.0, 0.0), "5");
  EXPECT_EQ(with_error(5.0, kNan), "5");
  EXPECT_EQ(with_error(kNan, 1.0), "-");
}

TEST(TextTable, SaysDurationsAsPeopleDo) {
  EXPECT_EQ(duration(0.4), "0 s");
  EXPECT_EQ(duration(59.6), "1 min 00 s");
  EXPECT_EQ(duration(3700), "1 h 01 min");
  EXPECT_EQ(duration(kNan), "-");
}

TEST(EstimateTable, SaysWhatIsFixedUndeterminedAndWhy) {
  protocol::EstimateDocument d;
  d.model = "oleo";
  d.parameters = {
      {"theta1", "orifice_damping", "1/m", 16.67123, 0.0243, 16.6231, 16.7193, false, false, true},
      {"theta2", "gas_spring", "m/s^2", 1.5, kNan, kNan, kNan, false, false, false},
      {"theta4", "gas_spring", "-", 1.0, 0.0, 1.0, 1.0, true, false, true},
      {"c", "viscous_damping", "1/s", 0.0, 0.1, -0.2, 0.2, false, true, true}};
  d.warnings = {"add runs at other frequencies"};
  d.cycles_used = 1;
  d.runs_used = 2;
  const std::string text = estimate_table(d);
  EXPECT_NE(text.find("theta1         16.671 ± 0.024  16.623 .. 16.719  1/m    orifice_damping\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("not determined\n"), std::string::npos);
  EXPECT_NE(text.find("fixed\n"), std::string::npos);
  EXPECT_NE(text.find("at its bound\n"), std::string::npos);
  EXPECT_NE(text.find("1 cycle of 2 runs"), std::string::npos);
  EXPECT_NE(text.find("NOT usable: not converged\n"), std::string::npos);
  EXPECT_NE(text.find("warning: add runs at other frequencies\n"), std::string::npos);
  EXPECT_EQ(estimate_line(d),
            "theta1 16.671 ± 0.024, theta2 not determined, c 0.00 ± 0.10 (not usable)");

  // A third verdict beside usable and not usable.
  d.usable = d.converged = true;
  EXPECT_NE(estimate_table(d).find("\nusable\n"), std::string::npos);
  d.intervals_hold = false;
  const std::string doubtful = estimate_table(d);
  EXPECT_NE(doubtful.find("the values stand, the INTERVALS DO NOT"), std::string::npos);
  EXPECT_EQ(doubtful.find("usable"), std::string::npos);
  EXPECT_TRUE(estimate_line(d).ends_with(" (the intervals do not hold)"));
}

}  // namespace
}  // namespace shaker::report
