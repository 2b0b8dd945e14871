#include "estimator/drop/drop_rule.hpp"

#include <gmock/gmock.h>

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

Result<RuleDrop> by_rule(const std::string& rule, std::optional<double> wing_loading,
                         std::optional<double> sink_speed) {
  RuleData data;
  data.rule = rule;
  data.weight = 12e3;
  data.wing_loading = wing_loading;
  data.sink_speed = sink_speed;
  return drop_by_rule(data, [](double, double, double) -> Result<double> { return 0.2; });
}

TEST(RuleHeight, IsSilentInsideOfTheRulesRange) {
  // 18 lbf/ft^2: 3.6 sqrt(18) = 15.3 in.
  EXPECT_EQ(by_rule("23.725", 861.8, {})->remark, "");
  EXPECT_EQ(by_rule("27.725", {}, 2.2)->remark, "");
  EXPECT_EQ(by_rule("29.725", {}, 3.0)->remark, "");
  EXPECT_EQ(by_rule("27.725", {}, {})->remark, "");
}

TEST(RuleHeight, SaysWhereTheDataAskForAnother) {
  const auto wing = by_rule("23.725", 86180.0, {});
  EXPECT_NEAR(wing->height, 18.7 * 0.0254, 1e-12);
  EXPECT_THAT(wing->remark, HasSubstr("the wing loading asks for a height of 152.7 in"));
  EXPECT_THAT(wing->remark, HasSubstr("9.2 to 18.7 in, so 18.7 in is taken"));
  const auto fast = by_rule("27.725", {}, 9.0);
  EXPECT_NEAR(fast->height, 13 * 0.0254, 1e-12);
  EXPECT_THAT(fast->remark, HasSubstr("a sink speed of 9 m/s"));
  const auto slow = by_rule("29.725", {}, 0.5);
  EXPECT_NEAR(slow->height, 8 * 0.0254, 1e-12);
  EXPECT_THAT(slow->remark, HasSubstr("at least 8 in"));
}

}  // namespace
}  // namespace shaker::estimator
