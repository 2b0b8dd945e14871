#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/can/candump_log.hpp"
#include "protocol/can/error_frame.hpp"

namespace shaker::protocol::can {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(CandumpLog, ReadsClassicFrames) {
  const auto entry = parse_log_line("(1436509052.249713) vcan0 044#2A366C2BBA");
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->t_ns, 1436509052249713000);
  EXPECT_EQ(entry->interface, "vcan0");
  EXPECT_EQ(entry->frame.id, 0x44u);
  EXPECT_FALSE(entry->frame.extended);
  EXPECT_THAT(entry->frame.bytes(), ElementsAre(0x2A, 0x36, 0x6C, 0x2B, 0xBA));
}

TEST(CandumpLog, ReadsExtendedRemoteAndEmptyFrames) {
  const auto extended = parse_log_line("(0.5) can0 00000123#FF\r\n");
  ASSERT_TRUE(extended);
  EXPECT_TRUE(extended->frame.extended);
  EXPECT_EQ(extended->frame.id, 0x123u);
  EXPECT_EQ(extended->t_ns, 500'000'000);
  const auto remote = parse_log_line("(0.000000) can0 123#R8");
  ASSERT_TRUE(remote);
  EXPECT_TRUE(remote->frame.remote);
  EXPECT_EQ(remote->frame.length, 8);
  const auto empty = parse_log_line("(0.000000) can0 123#");
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->frame.length, 0);
  EXPECT_TRUE(parse_log_line("(0.000000) can0 123#1122334455667788_9 R"));
}

TEST(CandumpLog, ReadsFdFrames) {
  const auto fd = parse_log_line("(1.000000) can1 1F334455##1AABBCC");
  ASSERT_TRUE(fd);
  EXPECT_TRUE(fd->frame.fd);
  EXPECT_THAT(fd->frame.bytes(), ElementsAre(0xAA, 0xBB, 0xCC));
  EXPECT_TRUE(parse_log_line("(1.0) c 123##0" + std::string(128, 'A')));
}

// The digits of the fraction count: .5 is 500 ms, .000000005 is 5 ns.
TEST(CandumpLog, ReadsTimesToTheNanosecond) {
  const std::pair<const char*, std::int64_t> times[] = {
      {"0.5", 500'000'000},           {"0.05", 50'000'000},
      {"1.000001", 1'000'001'000},    {"2.000000005", 2'000'000'005},
      {"3.123456789", 3'123'456'789}, {"9000000000.0", 9'000'000'000'000'000'000}};
  for (const auto& [text, ns] : times) {
    const auto entry = parse_log_line("(" + std::string(text) + ") can0 123#00");
    ASSERT_TRUE(entry) << text;
    EXPECT_EQ(entry->t_ns, ns) << text;
  }
  for (const char* text : {"(9000000001.0)", "(1.)", "(.5)", "(.)", "(1.5", "1.5)",
                           "(1.0123456789)", "(1.-5)", "(1.5x)", "(1)"}) {
    EXPECT_FALSE(parse_log_line(std::string(text) + " can0 123#00")) << text;
  }
}

TEST(CandumpLog, ReadsIdentifiersToTheirLast) {
  EXPECT_EQ(parse_log_line("(0.0) c 7ff#")->frame.id, 0x7FFu);
  const auto extended = parse_log_line("(0.0) c 1FFFFFFF#");
  EXPECT_TRUE(extended->frame.extended && !extended->frame.error);
  EXPECT_EQ(extended->frame.id, 0x1FFFFFFFu);
  const auto error = parse_log_line("(0.0) c 3FFFFFFF#");
  EXPECT_TRUE(error->frame.error && !error->frame.extended);
  EXPECT_EQ(error->frame.id, 0x1FFFFFFFu);
  for (const char* text : {"40000000#", "800#", "FFF#", "1234567#", "123456789#", "0000#", "12G#"})
    EXPECT_FALSE(parse_log_line("(0.0) c " + std::string(text))) << text;
}

TEST(CandumpLog, ReadsLengthsToTheirLast) {
  EXPECT_EQ(parse_log_line("(0.0) c 123#R")->frame.length, 0);
  EXPECT_EQ(parse_log_line("(0.0) c 123#R0")->frame.length, 0);
  EXPECT_FALSE(parse_log_line("(0.0) c 123#R/"));
  EXPECT_FALSE(parse_log_line("(0.0) c 123#R11"));
  EXPECT_EQ(parse_log_line("(0.0) c 123#1122334455667788")->frame.length, 8);
  EXPECT_EQ(parse_log_line("(0.0) c 123##0" + std::string(128, 'a'))->frame.length, 64);
  EXPECT_EQ(parse_log_line("(0.0) c 123#1122334455667788_F")->frame.length, 8);
  EXPECT_FALSE(parse_log_line("(0.0) c 123#1122334455667788_"));
  EXPECT_FALSE(parse_log_line("(0.0) c 123#1122334455667788_9A"));
  EXPECT_FALSE(parse_log_line("(0.0) c 123#1122334455667788_G"));
  EXPECT_THAT(parse_log_line("(0.0) c 123#9aF0")->frame.bytes(), ElementsAre(0x9A, 0xF0));
}

TEST(CandumpLog, RefusesWhatIsNotALogLine) {
  for (const std::string line : {"",
                                 "#",
                                 "(",
                                 "()",
                                 "(1)",
                                 "(1.0)",
                                 "(1.0) can0",
                                 "(1.0) can0 123",
                                 "(1.0) can0 12#00",
                                 "(1.0) can0 800#00",
                                 "(1.0) can0 123#0",
                                 "(1.0) can0 123#0G",
                                 "(x.0) can0 123#00",
                                 "(1.0) can0 123#112233445566778899",
                                 "(1.0) can0 123##",
                                 "(1.0) can0 123##1A",
                                 "(1.1234567890) can0 123#00",
                                 "(99999999999.0) can0 123#00",
                                 "(1.0) can0 F2345678#00",
                                 "(1.0) can0 123#R9",
                                 "(1.0) can0 123#00 extra",
                                 "(-1.0) can0 123#00"}) {
    EXPECT_FALSE(parse_log_line(line)) << line;
  }
  EXPECT_FALSE(parse_log_line("(1.0) c 123##0" + std::string(130, 'A')));
}

TEST(ErrorFrame, SaysBusOffWithItsRemedy) {
  const auto entry = parse_log_line("(1.0) can0 20000040#0000000000000000");
  ASSERT_TRUE(entry);
  ASSERT_TRUE(entry->frame.error);
  EXPECT_TRUE(interpret_error(entry->frame).bus_off);
  std::string text;
  describe_error(entry->frame, "can0", text);
  EXPECT_THAT(text, HasSubstr("can0: the controller is bus-off"));
  EXPECT_THAT(text, HasSubstr("ip link set can0 type can restart-ms 100"));
}

TEST(ErrorFrame, TellsTheControllersStates) {
  const auto report = [](const std::string& text) {
    return interpret_error(parse_log_line("(1.0) can0 " + text)->frame);
  };
  EXPECT_TRUE(report("20000100#0000000000000000").restarted);
  EXPECT_TRUE(report("20000004#0010000000000000").passive);
  EXPECT_EQ(report("20000004#0001000000000000").lost, 1u);
  EXPECT_EQ(report("20000004#").lost, 0u) << "a cut error frame is not read past its end";
}

TEST(ErrorFrame, HasASentenceForEveryClass) {
  for (int bit = 0; bit < 29; ++bit) {
    Frame frame;
    frame.error = true;
    frame.id = 1u << bit;
    std::string text;
    describe_error(frame, "can0", text);
    EXPECT_GT(text.size(), 30u) << bit;
  }
}

}  // namespace
}  // namespace shaker::protocol::can
