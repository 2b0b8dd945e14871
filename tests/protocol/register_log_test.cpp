#include "protocol/modbus/register_log.hpp"

#include <array>

#include <gtest/gtest.h>

namespace shaker::protocol::modbus {
namespace {

using Kind = RegisterLogLine::Kind;

TEST(RegisterLog, ReadsWhatAPersonWouldWrite) {
  const auto line =
      parse_register_line("(12.345678901 12.346998210) input6#3E22D0E54120 holding10#0001\r");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->asked_ns, 12'345'678'901);
  EXPECT_EQ(line->received_ns, 12'346'998'210);
  EXPECT_EQ(line->kind, Kind::poll);
  std::array<std::uint16_t, 3> words{};
  auto blocks = line->blocks;
  EXPECT_FALSE(take_block(blocks, {RegisterTable::input, 7, 3}, words)) << "another address";
  EXPECT_FALSE(take_block(blocks, {RegisterTable::holding, 6, 3}, words)) << "another table";
  ASSERT_TRUE(take_block(blocks, {RegisterTable::input, 6, 3}, words));
  EXPECT_EQ(words, (std::array<std::uint16_t, 3>{0x3E22, 0xD0E5, 0x4120}));
  ASSERT_TRUE(take_block(blocks, {RegisterTable::holding, 10, 1}, words));
  EXPECT_EQ(words[0], 1);
  EXPECT_TRUE(blocks.empty());
}

TEST(RegisterLog, ReadsWhatItWrites) {
  std::string text;
  begin_register_line(text, 3'000'000'007, 3'001'000'000);
  const std::array<std::uint16_t, 2> words{0xFFFF, 0x0000};
  add_block(text, {RegisterTable::input, 65534, 2}, words);
  EXPECT_EQ(text, "(3.000000007 3.001000000) input65534#FFFF0000");
  const auto line = parse_register_line(text);
  ASSERT_TRUE(line);
  auto blocks = line->blocks;
  std::array<std::uint16_t, 2> read{};
  ASSERT_TRUE(take_block(blocks, {RegisterTable::input, 65534, 2}, read));
  EXPECT_EQ(read, words);
}

TEST(RegisterLog, TellsConnectionsAndMissedAnswers) {
  EXPECT_EQ(parse_register_line("(1.000000000 1.000000000) connected")->kind, Kind::connected);
  EXPECT_EQ(parse_register_line("(1.000000000 1.100000000) error")->kind, Kind::error);
}

TEST(RegisterLog, RefusesWhatIsNoLineOfALog) {
  for (const char* text :
       {"", "rubbish", "(1.0 1.0) connected", "(1.000000000 0.900000000) input6#00",
        "(-1.000000000 1.000000000) error", "(1.000000000) error",
        "(1.00000-000 1.000000000) error", "(99999999999999999999.000000000 1.000000000) error"}) {
    EXPECT_FALSE(parse_register_line(text)) << text;
  }
  std::array<std::uint16_t, 2> words{};
  for (const char* blocks : {"input6#0000", "input6#0000000", "input6#00GG0000", "input6#00000000x",
                             "input6", "6#00000000", "input6#-0010000"}) {
    std::string_view rest = blocks;
    EXPECT_FALSE(take_block(rest, {RegisterTable::input, 6, 2}, words)) << blocks;
    EXPECT_EQ(rest, blocks) << "nothing is taken of it";
  }
}

}  // namespace
}  // namespace shaker::protocol::modbus
