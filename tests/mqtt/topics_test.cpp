#include "mqtt/topics.hpp"

#include <gmock/gmock.h>

namespace shaker::mqtt {
namespace {

using ::testing::HasSubstr;

TEST(Topics, ALevelHasNothingThatABrokerOrAShellTripsOver) {
  EXPECT_EQ(topic_level("simulated"), "simulated");
  EXPECT_EQ(topic_level("Rig_2-b.1"), "Rig_2-b.1");
  EXPECT_EQ(topic_level("hall 3/rig#1+"), "hall_3_rig_1_");
  EXPECT_EQ(topic_level("$SYS"), "_SYS");
  EXPECT_EQ(topic_level(std::string("a\0b\n\x7f", 5)), "a_b__");
  EXPECT_EQ(topic_level("Pr\xC3\xBC"
                        "fstand"),
            "Pr\xC3\xBC"
            "fstand");
  EXPECT_EQ(topic_level("a\xC2\x85"
                        "b"),
            "a_b");
  EXPECT_EQ(topic_level("a\xC2\xB5"), "a\xC2\xB5");
  EXPECT_EQ(topic_level(""), "rig");
}

TEST(Topics, APrefixHasOneOrMoreSuchLevels) {
  EXPECT_TRUE(check_prefix("shaker"));
  EXPECT_TRUE(check_prefix("site/hall-3/shaker"));
  for (const char* bad : {"", "/", "/shaker", "shaker/", "a//b", "a/+/b", "#", "a b", "$SYS/x"}) {
    const auto checked = check_prefix(bad);
    ASSERT_FALSE(checked) << bad;
    EXPECT_THAT(checked.error().what, HasSubstr("\"" + std::string(bad) + "\""));
  }
}

}  // namespace
}  // namespace shaker::mqtt
