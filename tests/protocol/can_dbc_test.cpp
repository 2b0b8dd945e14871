#include <array>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/can/database.hpp"

namespace shaker::protocol::can {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string file_text(const std::string& name) {
  std::ifstream file(SHAKER_TEST_DATA "/can/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Database rig() {
  auto parsed = parse_dbc(file_text("rig.dbc"), "rig.dbc");
  EXPECT_TRUE(parsed.ok()) << parsed.error().what;
  return parsed.ok() ? *parsed : Database{};
}

std::string error_of(const std::string& text) {
  const auto parsed = parse_dbc(text, "x.dbc");
  return parsed.ok() ? "no error" : parsed.error().what;
}

TEST(Dbc, ReadsAFileWithCrlfLatin1CommentsAndSectionsItDoesNotKnow) {
  const Database db = rig();
  ASSERT_EQ(db.messages.size(), 6u) << "the pseudo-message is none";
  const Message* tpdo = db.find("transducer_tpdo1");
  ASSERT_NE(tpdo, nullptr);
  EXPECT_EQ(tpdo->id, 385u);
  EXPECT_FALSE(tpdo->extended);
  EXPECT_EQ(tpdo->size, 7u);
  EXPECT_EQ(tpdo->cycle_time_s, 0.001);
  const Signal* position = tpdo->find("position");
  ASSERT_NE(position, nullptr);
  EXPECT_EQ(position->format, NumberFormat::signed_integer);
  EXPECT_EQ(position->factor, 1e-9);
  EXPECT_EQ(position->maximum, 0.5);
  EXPECT_EQ(position->unit, "m");
  EXPECT_EQ(db.find("accelerometer")->find("temperature")->unit, "°C");
  EXPECT_FALSE(db.find("wide")->cycle_time_s) << "the default of 0 ms says nothing";
}

// The boundaries of RFC 3629, table of section 4. Bytes that are not UTF-8 are Latin-1.
TEST(Dbc, TellsUtf8FromLatin1) {
  const auto unit = [](const std::string& bytes) {
    const auto parsed =
        parse_dbc("BO_ 1 m: 8 X\n SG_ s : 0|8@1+ (1,0) [0|0] \"" + bytes + "\" X\n", "x.dbc");
    EXPECT_TRUE(parsed.ok()) << parsed.error().what;
    return parsed.ok() ? parsed->find("m")->find("s")->unit : "refused";
  };
  for (const std::string utf8 :
       {"\x7E", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xE0\xBF\xBF", "\xE1\x80\x80",
        "\xEC\xBF\xBF", "\xED\x80\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBF",
        "\xF0\x90\x80\x80", "\xF0\xBF\xBF\xBF", "\xF1\x80\x80\x80", "\xF3\xBF\xBF\xBF",
        "\xF4\x80\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(unit(utf8), utf8);
  }
  for (const std::string latin1 :
       {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2\x7F", "\xC2\xC0", "\xDF\x41",
        "\xE0\x9F\xBF", "\xE0\xA0", "\xE1\x80", "\xE1\x80\x41", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
        "\xF0\x90\x80", "\xF1\x80\x80\x41", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    std::string expected;
    for (const char c : latin1) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte >= 0x80) expected += byte >= 0xC0 ? '\xC3' : '\xC2';
      expected += byte >= 0xC0 ? static_cast<char>(byte - 0x40) : c;
    }
    EXPECT_EQ(unit(latin1), expected);
  }
}

TEST(Dbc, TellsExtendedFromStandardIdentifiers) {
  const Database db = rig();
  const Message* cell = db.find("load_cell");
  ASSERT_NE(cell, nullptr);
  EXPECT_TRUE(cell->extended);
  EXPECT_EQ(cell->id, 2566844926u - 0x80000000u);
  EXPECT_EQ(db.find(cell->id, true), cell);
  EXPECT_EQ(db.find(cell->id, false), nullptr);
}

TEST(Dbc, ReadsFloatsInBothByteOrders) {
  const Database db = rig();
  const Message& cell = *db.find("load_cell");
  // 1.0f = 3F800000, -2.5f = C0200000
  const std::array<std::uint8_t, 8> data{0x00, 0x00, 0x80, 0x3F, 0xC0, 0x20, 0x00, 0x00};
  EXPECT_EQ(decode(cell, *cell.find("force"), data).value, 1.0);
  EXPECT_EQ(decode(cell, *cell.find("gauge"), data).value, -2.5);
  const Message& wide = *db.find("wide");
  std::array<std::uint8_t, 64> fd{};
  fd[6] = 0xF8, fd[7] = 0xBF;  // -1.5 = BFF8000000000000
  fd[60] = 0xFF, fd[61] = 0xFF, fd[62] = 0xFF, fd[63] = 0xFE;
  EXPECT_EQ(decode(wide, *wide.find("first"), fd).value, -1.5);
  EXPECT_DOUBLE_EQ(decode(wide, *wide.find("last"), fd).value, -2e-6);
}

TEST(Dbc, FollowsAMultiplexorThatStandsAfterItsSignals) {
  const Database db = rig();
  const Message& message = *db.find("accelerometer");
  std::array<std::uint8_t, 6> data{0x00, 0x01, 0x03, 0xE8, 0x00, 0x00};
  EXPECT_EQ(decode(message, *message.find("mass"), data).presence, Presence::present);
  EXPECT_DOUBLE_EQ(decode(message, *message.find("mass"), data).value, 1.0);
  EXPECT_EQ(decode(message, *message.find("temperature"), data).presence, Presence::not_selected);
  data[4] = 1;
  EXPECT_DOUBLE_EQ(decode(message, *message.find("temperature"), data).value, 100.0);
  EXPECT_EQ(decode(message, *message.find("mass"), std::span(data).first(4)).presence,
            Presence::malformed)
      << "the multiplexor itself is cut off";
}

TEST(Dbc, AcceptsShorterFramesForTheSignalsThatAreInThem) {
  const Database db = rig();
  const Message& tpdo = *db.find("transducer_tpdo1");
  const std::array<std::uint8_t, 7> data{0xFF, 0xFF, 0xFF, 0xFF, 0x01, 0x00, 0x80};
  EXPECT_DOUBLE_EQ(decode(tpdo, *tpdo.find("position"), data).value, -1e-9);
  const auto six = std::span(data).first(6);
  EXPECT_DOUBLE_EQ(decode(tpdo, *tpdo.find("position"), six).value, -1e-9);
  EXPECT_EQ(decode(tpdo, *tpdo.find("sensor_status"), six).presence, Presence::malformed);
}

TEST(Dbc, ResolvesExtendedMultiplexing) {
  const std::string text =
      "BO_ 5 m: 4 X\n"
      " SG_ outer M : 0|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ inner m1M : 8|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ leaf m2 : 16|8@1+ (1,0) [0|0] \"\" X\n"
      "SG_MUL_VAL_ 5 inner outer 1-1;\nSG_MUL_VAL_ 5 leaf inner 2-3, 7 - 9;\n";
  const auto db = parse_dbc(text, "x.dbc");
  ASSERT_TRUE(db.ok()) << db.error().what;
  const Message& m = db->messages[0];
  const auto presence = [&](std::uint8_t outer, std::uint8_t inner) {
    const std::array<std::uint8_t, 4> data{outer, inner, 42, 0};
    return decode(m, *m.find("leaf"), data).presence;
  };
  EXPECT_EQ(presence(1, 2), Presence::present);
  EXPECT_EQ(presence(1, 8), Presence::present);
  EXPECT_EQ(presence(1, 4), Presence::not_selected);
  EXPECT_EQ(presence(0, 2), Presence::not_selected);
}

TEST(Dbc, ReadsAFileWithoutLineBreaksAtItsEndAndCompactSpelling) {
  const auto db = parse_dbc(
      "BO_ 1 a:8 X\nSG_ s:0|8@1+(1,0)[0|0]\"\" X,\n Y\nSG_ t : 8|8@1- (-1,+2) "
      "[0|0] \"\"  X",
      "x.dbc");
  ASSERT_TRUE(db.ok()) << db.error().what;
  ASSERT_EQ(db->messages[0].signals.size(), 2u);
  EXPECT_EQ(db->messages[0].signals[1].factor, -1.0);
}

TEST(Dbc, NamesPlaceFindingAndExpectation) {
  const struct {
    std::string text, place, found, expected;
  } cases[] = {
      {"BO_ 1 a: 8 X\n SG_ s : 0;16@1+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "found ';'",
       "expected '|' between start bit and length"},
      {"\nBO_ five a: 8 X\n", "x.dbc:2: ", "found 'five'", "identifier after BO_ (a whole number)"},
      {"BO_ 99999999999999999999 a: 8 X\n", "x.dbc:1: ", "found '99999999999999999999'",
       "identifier"},
      {"BO_ 1 a: 8 X\n SG_ s : 60|8@1+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "signal s at 60|8@1",
       "fits into the 8 bytes of message a"},
      {"BO_ 1 a: 8 X\n SG_ s : 56|9@0+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "signal s at 56|9@0",
       "fits"},
      {"BO_ 1 a: 8 X\n SG_ s : 0|65@1+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "65 bits", "1 to 64"},
      {"BO_ 1 a: 8 X\n SG_ s : 0|8@1+ (0,0) [0|0] \"\" X\n", "x.dbc:2: ", "factor 0", "not 0"},
      {"BO_ 1 a: 8 X\n SG_ s : 0|8@2+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "byte order 2", "Intel"},
      {"BO_ 4096 a: 8 X\n", "x.dbc:1: ", "identifier 4096", "bit 31"},
      {"BO_ 1 a: 8 X\n\nBO_ 1 b: 8 X\n", "x.dbc:3: ", "message b with identifier 1", "line 1"},
      {"BO_ 1 a: 8 X\n\nBO_ 2 a: 8 X\n", "x.dbc:3: ", "second message a", "line 1"},
      {"BO_ 1 a: 8 X\nCM_ \"two\nlines\";\n\nBO_ 1 b: 8 X\n", "x.dbc:5: ", "message b", "line 1"},
      {"BO_ 1 a: 8 X\n SG_ s m0 : 0|8@1+ (1,0) [0|0] \"\" X\n",
       "x.dbc:2: ", "signal s in message a with 0 multiplexors", "marked M"},
      {"BO_ 1 a: 8 X\n SG_ s m0M : 0|8@1+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "signal s",
       "SG_MUL_VAL_"},
      {"BO_ 1 a: 8 X\n SG_ s mx : 0|8@1+ (1,0) [0|0] \"\" X\n", "x.dbc:2: ", "found 'mx'", "m0"},
      {"BO_ 1 a: 8 X\n SG_ s : 0|8@1+ (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 1 s : 1;\n",
       "x.dbc:3: ", "float32 for signal s of 8 bits", "32 bits"},
      {"BO_ 1 a: 8 X\nSIG_VALTYPE_ 2 s : 1;\n", "x.dbc:2: ", "message 2", "BO_"},
      {"BO_ 1 a: 8 X\nCM_ \"never ends\n", "x.dbc:2: ", "without an end", "closing"},
      {" SG_ s : 0|8@1+ (1,0) [0|0] \"\" X\n", "x.dbc:1: ", "found 'SG_'", "BO_ before"},
      {"{\"not\": \"a dbc\"}", "x.dbc:1: ", "found '{'", "section"},
      {"BO_ 1 a: 8 X\n SG_ a M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ b m0M : 8|8@1+ (1,0) [0|0] \"\" "
       "X\n"
       "SG_MUL_VAL_ 1 a b 0-0;\nSG_MUL_VAL_ 1 b a 0-0;\n",
       "x.dbc:2: ", "selects itself", "every frame"},
      {"", "x.dbc: ", "no message", "DBC file?"},
  };
  for (const auto& c : cases) {
    EXPECT_THAT(error_of(c.text),
                AllOf(StartsWith(c.place), HasSubstr(c.found), HasSubstr(c.expected)))
        << c.text;
  }
}

}  // namespace
}  // namespace shaker::protocol::can
