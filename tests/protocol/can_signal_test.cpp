#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/can/signal.hpp"

namespace shaker::protocol::can {
namespace {

using ::testing::HasSubstr;

Signal make(int start, int length, ByteOrder order,
            NumberFormat format = NumberFormat::unsigned_integer) {
  Signal signal;
  signal.name = "s";
  signal.start_bit = start;
  signal.length = length;
  signal.order = order;
  signal.format = format;
  return signal;
}

TEST(Signal, ReadsTheThreeReferenceValues) {
  const std::array<std::uint8_t, 3> data{0x02, 0xEF, 0x70};
  EXPECT_EQ(decode(make(0, 16, ByteOrder::intel), data), 61186.0);
  EXPECT_EQ(decode(make(7, 16, ByteOrder::motorola), data), 751.0);
  EXPECT_EQ(decode(make(0, 16, ByteOrder::motorola), data), 30648.0);
}

TEST(Signal, IsNotReadFromAFrameThatIsTooShort) {
  const std::array<std::uint8_t, 2> data{0x02, 0xEF};
  EXPECT_EQ(bytes_needed(make(0, 16, ByteOrder::motorola)), 3u);
  EXPECT_FALSE(decode(make(0, 16, ByteOrder::motorola), data));
  EXPECT_FALSE(decode(make(1, 16, ByteOrder::intel), data));
  EXPECT_FALSE(decode(make(0, 1, ByteOrder::intel), {}));
}

TEST(Signal, RefusesValuesThatDoNotFit) {
  std::array<std::uint8_t, 2> data{0xAA, 0x55};
  auto signal = make(0, 8, ByteOrder::intel);
  signal.factor = 0.5;
  const auto refused = encode(signal, 200.0, data);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("s: 200 does not fit; its 8 bits hold 0 to 127.5"));
  EXPECT_FALSE(encode(signal, -0.5, data).ok());
  EXPECT_FALSE(encode(signal, std::nan(""), data).ok());
  EXPECT_FALSE(encode(make(8, 16, ByteOrder::intel), 1.0, data).ok());
  EXPECT_FALSE(encode(make(0, 64, ByteOrder::intel), std::ldexp(1.0, 64), data).ok());
  std::array<std::uint8_t, 4> four{};
  EXPECT_FALSE(encode(make(0, 32, ByteOrder::intel, NumberFormat::float32), 1e39, four).ok());
  EXPECT_EQ(data, (std::array<std::uint8_t, 2>{0xAA, 0x55}));
}

// Two's complement of n bits holds -2^(n-1) to 2^(n-1) - 1, including values that round into
// it.
TEST(Signal, HoldsASignedRangeToItsLastValue) {
  struct Row {
    int length;
    double lowest, highest;
    std::vector<std::uint8_t> low_bytes, high_bytes;
  };
  const Row rows[] = {{8, -128.0, 127.0, {0x80, 0x00, 0x00}, {0x7F, 0x00, 0x00}},
                      {16, -32768.0, 32767.0, {0x00, 0x80, 0x00}, {0xFF, 0x7F, 0x00}},
                      {12, -2048.0, 2047.0, {0x00, 0x08, 0x00}, {0xFF, 0x07, 0x00}},
                      {1, -1.0, 0.0, {0x01, 0x00, 0x00}, {0x00, 0x00, 0x00}}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.length);
    const auto signal = make(0, row.length, ByteOrder::intel, NumberFormat::signed_integer);
    std::vector<std::uint8_t> data(3);
    for (const double value : {row.lowest, row.lowest - 0.49}) {
      ASSERT_TRUE(encode(signal, value, data).ok()) << value;
      EXPECT_EQ(data, row.low_bytes);
      EXPECT_EQ(decode(signal, data), row.lowest);
    }
    for (const double value : {row.highest, row.highest + 0.49}) {
      ASSERT_TRUE(encode(signal, value, data).ok()) << value;
      EXPECT_EQ(data, row.high_bytes);
      EXPECT_EQ(decode(signal, data), row.highest);
    }
    for (const double value :
         {row.lowest - 1.0, row.lowest - 0.51, row.highest + 1.0, row.highest + 0.51}) {
      EXPECT_FALSE(encode(signal, value, data).ok()) << value;
    }
    EXPECT_EQ(data, row.high_bytes) << "a refused value changes nothing";
  }
}

TEST(Signal, SaysWhichRangeASignedSignalHolds) {
  std::array<std::uint8_t, 1> data{};
  auto signal = make(0, 8, ByteOrder::intel, NumberFormat::signed_integer);
  EXPECT_THAT(encode(signal, 200.0, data).error().what, HasSubstr("its 8 bits hold -128 to 127"));
  signal.factor = -0.5;
  signal.offset = 1.0;
  EXPECT_THAT(encode(signal, 70.0, data).error().what, HasSubstr("its 8 bits hold -62.5 to 65"));
  ASSERT_TRUE(encode(signal, 65.0, data).ok());
  EXPECT_EQ(data[0], 0x80);
}

TEST(Signal, HoldsTheLargestUnsignedValueAndNoMore) {
  std::array<std::uint8_t, 8> data{};
  const auto byte = make(0, 8, ByteOrder::intel);
  EXPECT_TRUE(encode(byte, 255.4, data).ok());
  EXPECT_EQ(data[0], 0xFF);
  EXPECT_FALSE(encode(byte, 256.0, data).ok());
  EXPECT_FALSE(encode(byte, -1.0, data).ok());
  EXPECT_TRUE(encode(byte, 0.0, data).ok());
  const auto whole = make(0, 64, ByteOrder::intel);
  EXPECT_TRUE(encode(whole, std::ldexp(1.0, 63), data).ok());
  EXPECT_EQ(data[7], 0x80);
  const auto largest = static_cast<double>(std::numeric_limits<float>::max());
  std::array<std::uint8_t, 4> four{};
  EXPECT_TRUE(encode(make(0, 32, ByteOrder::intel, NumberFormat::float32), -largest, four).ok());
  EXPECT_EQ(four, (std::array<std::uint8_t, 4>{0xFF, 0xFF, 0x7F, 0xFF}));
  auto scaled = make(0, 32, ByteOrder::intel, NumberFormat::float32);
  scaled.factor = 2.0;
  scaled.offset = 9.0;
  EXPECT_TRUE(encode(scaled, 11.0, four).ok());  // as 1.0
  EXPECT_EQ(four, (std::array<std::uint8_t, 4>{0x00, 0x00, 0x80, 0x3F}));
}

TEST(Signal, IsInRangeWithinHalfAStep) {
  auto signal = make(0, 16, ByteOrder::intel);
  EXPECT_TRUE(in_range(signal, 1e9)) << "no range is stated";
  signal.factor = 0.1;
  signal.minimum = -1.0;
  signal.maximum = 1.0;
  EXPECT_TRUE(in_range(signal, 1.04));
  EXPECT_FALSE(in_range(signal, 1.06));
  EXPECT_TRUE(in_range(signal, -1.04));
  signal.factor = -0.1;
  EXPECT_TRUE(in_range(signal, 1.04)) << "a step has a size, whatever its sign";
  EXPECT_FALSE(in_range(signal, 1.06));
  signal.factor = 0.1;
  EXPECT_FALSE(in_range(signal, -1.06));
  EXPECT_FALSE(in_range(signal, std::numeric_limits<double>::quiet_NaN()));
  signal.minimum = 0.0;
  EXPECT_FALSE(in_range(signal, -0.06)) << "0 to 1 is a range";
  signal.minimum = -1.0;
  signal.maximum = 0.0;
  EXPECT_FALSE(in_range(signal, 0.06)) << "-1 to 0 is a range";
}

// ---- the table of tests/data/can/reference.py, which reads bit by bit --------------------------

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line + ",");
  for (std::string field; std::getline(in, field, ',');)
    fields.push_back(field);
  return fields;
}

std::vector<std::uint8_t> from_hex(const std::string& hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

NumberFormat format_from(const std::string& letter) {
  return letter == "u"   ? NumberFormat::unsigned_integer
         : letter == "s" ? NumberFormat::signed_integer
         : letter == "f" ? NumberFormat::float32
                         : NumberFormat::float64;
}

TEST(Signal, AgreesWithTheIndependentReference) {
  std::ifstream file(SHAKER_TEST_DATA "/can/signals.csv");
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  int rows = 0, short_rows = 0, encoded = 0;
  while (std::getline(file, line)) {
    SCOPED_TRACE(line);
    const auto f = split(line);
    ASSERT_EQ(f.size(), 10u);
    auto signal = make(std::stoi(f[0]), std::stoi(f[1]),
                       f[2] == "i" ? ByteOrder::intel : ByteOrder::motorola, format_from(f[3]));
    signal.factor = std::stod(f[4]);
    signal.offset = std::stod(f[5]);
    auto data = from_hex(f[6]);
    const auto decoded = decode(signal, data);
    ++rows;
    if (f[7] == "short") {
      ++short_rows;
      EXPECT_FALSE(decoded);
      continue;
    }
    ASSERT_TRUE(decoded);
    EXPECT_DOUBLE_EQ(*decoded, std::stod(f[7]));
    if (f[8].empty()) continue;
    ++encoded;
    const auto done = encode(signal, std::stod(f[8]), data);
    ASSERT_TRUE(done.ok()) << done.error().what;
    EXPECT_EQ(data, from_hex(f[9]));
  }
  EXPECT_EQ(rows, 600);
  EXPECT_GT(short_rows, 50);
  EXPECT_GT(encoded, 300);
}

}  // namespace
}  // namespace shaker::protocol::can
