#include "mqtt/outbox.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace shaker::mqtt {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Document numbered(int number, Nanoseconds made = {}) {
  return {json{{"n", number}}.dump(), made};
}

class OutboxTest : public ::testing::Test {
 protected:
  // "state 3", "bridge online": what is handed over now, at most `count`; confirms it if asked to.
  std::vector<std::string> drain(bool confirm = true, std::size_t count = 10'000) {
    std::vector<std::string> all;
    while (all.size() < count) {
      const auto one = outbox.next(now);
      if (!one) break;
      const std::string kind = kKindNames[index_of(one->kind)];
      all.push_back(kind + " " +
                    (one->kind == Kind::bridge
                         ? one->payload
                         : std::to_string(json::parse(one->payload)["n"].get<int>())));
      last = one->payload;
      tickets.push_back(one->ticket);
      if (confirm) outbox.confirmed(one->ticket);
    }
    return all;
  }
  Outbox outbox;
  Nanoseconds now{};
  std::string last;
  std::vector<std::uint64_t> tickets;
};

TEST_F(OutboxTest, KeepsTheNewestOfEachKindAndEveryAlarm) {
  outbox.say("daemon_lost");
  outbox.say("online");
  for (int n = 1; n <= 3; ++n) {
    outbox.put(Kind::health, numbered(n));
    outbox.put(Kind::alarm, numbered(10 * n));
    outbox.put(Kind::state, numbered(n));
    outbox.put(Kind::estimate, numbered(n));
  }
  outbox.begin_connection();
  EXPECT_THAT(drain(), ElementsAre("bridge online", "alarm 10", "alarm 20", "alarm 30", "state 3",
                                   "estimate 3", "health 3"));
  EXPECT_THAT(drain(), IsEmpty());
  EXPECT_EQ(outbox.alarms_waiting(), 0U);
  outbox.put(Kind::state, numbered(4));
  EXPECT_THAT(drain(), ElementsAre("state 4"));
}

TEST_F(OutboxTest, ANewConnectionGetsTheNewestOfEachKindOnceMore) {
  outbox.say("online");
  outbox.put(Kind::state, numbered(1));
  outbox.put(Kind::alarm, numbered(2));
  outbox.put(Kind::alarm, numbered(3));
  outbox.begin_connection();
  drain();
  outbox.begin_connection();
  EXPECT_THAT(drain(), ElementsAre("bridge online", "alarm 3", "state 1"));
  outbox.put(Kind::alarm, numbered(4));
  outbox.begin_connection();
  EXPECT_THAT(drain(), ElementsAre("bridge online", "alarm 4", "state 1"))
      << "alarm 3 is not the last";
}

TEST_F(OutboxTest, WhatTheBrokerDidNotConfirmWaitsAgain) {
  for (int n = 1; n <= 4; ++n)
    outbox.put(Kind::alarm, numbered(n));
  outbox.begin_connection();
  EXPECT_THAT(drain(false, 3), ElementsAre("alarm 1", "alarm 2", "alarm 3"));
  outbox.confirmed(tickets[0]);
  outbox.confirmed(tickets[2]);
  outbox.begin_connection();
  EXPECT_THAT(drain(), ElementsAre("alarm 2", "alarm 4"));
  outbox.confirmed(tickets[1]);  // of the connection before: too late, and nobody's any more
  EXPECT_EQ(outbox.alarms_waiting(), 0U);
}

TEST_F(OutboxTest, ABrokerThatDoesNotConfirmGetsNoMoreThanTheBound) {
  outbox.begin_connection();
  for (int n = 0; n < 50; ++n)
    outbox.put(Kind::alarm, numbered(n));
  EXPECT_EQ(drain(false).size(), Outbox::kMaxUnconfirmed);
  EXPECT_THAT(drain(false), IsEmpty());
  outbox.confirmed(tickets[4]);
  EXPECT_THAT(drain(false), ElementsAre("alarm 10"));
}

TEST_F(OutboxTest, DropsTheOldestAlarmsBeyondTheBoundAndSaysHowMany) {
  outbox = Outbox({.count = 3, .bytes = 1'000'000});
  for (int n = 1; n <= 8; ++n)
    outbox.put(Kind::alarm, numbered(n));
  EXPECT_EQ(outbox.alarms_dropped(), 5U);
  outbox.begin_connection();
  EXPECT_THAT(drain(true, 1), ElementsAre("alarm 6"));
  EXPECT_EQ(json::parse(last)["dropped_before"], 5);
  EXPECT_THAT(drain(), ElementsAre("alarm 7", "alarm 8"));
  EXPECT_FALSE(json::parse(last).contains("dropped_before"));
}

TEST_F(OutboxTest, DropsNoneThatHasBeenHandedOver) {
  outbox = Outbox({.count = 3, .bytes = 1'000'000});
  outbox.begin_connection();
  for (int n = 1; n <= 3; ++n)
    outbox.put(Kind::alarm, numbered(n));
  drain(false, 2);  // 1 and 2 are on their way
  outbox.put(Kind::alarm, numbered(4));
  outbox.put(Kind::alarm, numbered(5));
  EXPECT_EQ(outbox.alarms_dropped(), 2U);
  EXPECT_THAT(drain(), ElementsAre("alarm 5"));
  EXPECT_EQ(json::parse(last)["dropped_before"], 2);
  EXPECT_EQ(outbox.alarms_waiting(), 2U);
  outbox.confirmed(tickets[0]);
  outbox.confirmed(tickets[1]);
  EXPECT_EQ(outbox.alarms_waiting(), 0U);
}

TEST_F(OutboxTest, BytesHaveABoundToo) {
  outbox = Outbox({.count = 1000, .bytes = 10'000});
  for (int n = 1; n <= 100; ++n)
    outbox.put(Kind::alarm, {json{{"n", n}, {"text", std::string(1000, 'x')}}.dump(), {}});
  EXPECT_EQ(outbox.alarms_waiting() + outbox.alarms_dropped(), 100U);
  EXPECT_EQ(outbox.alarms_waiting(), 9U);
  outbox.put(Kind::alarm, {json{{"n", 0}, {"text", std::string(50'000, 'x')}}.dump(), {}});
  EXPECT_EQ(outbox.alarms_waiting(), 1U) << "the newest stays, however long";
  outbox.begin_connection();
  EXPECT_THAT(drain(), ElementsAre("alarm 0"));
  outbox.put(Kind::alarm, numbered(1));
  EXPECT_EQ(outbox.alarms_waiting(), 1U) << "what was confirmed does not count any more";
}

TEST_F(OutboxTest, ADocumentThatHasWaitedSaysSo) {
  outbox.put(Kind::estimate, numbered(1, seconds(100)));
  outbox.put(Kind::alarm, numbered(2, seconds(130)));
  outbox.put(Kind::health, numbered(3, seconds(160)));
  outbox.begin_connection();
  now = seconds(160) + std::chrono::milliseconds(250);
  drain();
  const auto health = json::parse(last);
  EXPECT_DOUBLE_EQ(health["age_s"].get<double>(), 0.25);
  EXPECT_EQ(health["ages_s"], (json{{"alarm", 30.25}, {"estimate", 60.25}}));
  outbox.begin_connection();
  now = seconds(1000);
  outbox.put(Kind::health, numbered(4, seconds(2000)));
  drain(true, 2);
  EXPECT_EQ(json::parse(last), (json{{"n", 1}, {"age_s", 900.0}}));
  drain();
  EXPECT_EQ(json::parse(last)["age_s"], 0.0) << "no age is negative";
}

TEST_F(OutboxTest, SaysWhetherTheNewestIsDelivered) {
  outbox.say("online");
  outbox.begin_connection();
  drain(false);
  outbox.say("offline");
  outbox.confirmed(tickets[0]);
  EXPECT_FALSE(outbox.delivered(Kind::bridge));
  EXPECT_THAT(drain(), ElementsAre("bridge offline"));
  EXPECT_TRUE(outbox.delivered(Kind::bridge));
  outbox.begin_connection();
  EXPECT_FALSE(outbox.delivered(Kind::bridge));
}

}  // namespace
}  // namespace shaker::mqtt
