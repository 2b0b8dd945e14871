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

TEST(Signal, IsInRangeWithinHalfAStep) {
  auto signal = make(0, 16, ByteOrder::intel);
  EXPECT_TRUE(in_range(signal, 1e9)) << "no range is stated";
  signal.factor = 0.1;
  signal.minimum = -1.0;
  signal.maximum = 1.0;
  EXPECT_TRUE(in_range(signal, 1.04));
  EXPECT_FALSE(in_range(signal, 1.06));
  EXPECT_FALSE(in_range(signal, -1.06));
  EXPECT_FALSE(in_range(signal, std::numeric_limits<double>::quiet_NaN()));
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
