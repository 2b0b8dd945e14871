#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "protocol/modbus/register.hpp"

namespace shaker::protocol::modbus {
namespace {

const std::map<std::string, RegisterType> kTypes = {{"u16", RegisterType::u16},
                                                    {"i16", RegisterType::i16},
                                                    {"u32", RegisterType::u32},
                                                    {"i32", RegisterType::i32},
                                                    {"f32", RegisterType::f32}};
const std::map<std::string, WordOrder> kOrders = {{"abcd", WordOrder::abcd},
                                                  {"cdab", WordOrder::cdab},
                                                  {"badc", WordOrder::badc},
                                                  {"dcba", WordOrder::dcba}};

struct Row {
  RegisterSpec spec;
  double value = 0.0;
  std::vector<std::uint16_t> words;
};

// Written by tests/data/modbus/make_registers.py with Python's struct module.
std::vector<Row> table() {
  std::ifstream file(SHAKER_TEST_DATA "/modbus/registers.csv");
  std::vector<Row> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string type, order, value, word;
    std::getline(fields, type, ',');
    std::getline(fields, order, ',');
    std::getline(fields, value, ',');
    Row row;
    row.spec.type = kTypes.at(type);
    row.spec.order = kOrders.at(order);
    row.value = std::stod(value);
    while (std::getline(fields, word, ',')) {
      if (!word.empty())
        row.words.push_back(static_cast<std::uint16_t>(std::stoi(word, nullptr, 16)));
    }
    rows.push_back(row);
  }
  return rows;
}

TEST(ModbusRegister, AgreesWithPythonsStructInEveryTypeAndWordOrder) {
  const std::vector<Row> rows = table();
  ASSERT_EQ(rows.size(), 4U * (8 + 8 + 7 + 9 + 10));
  for (const Row& row : rows) {
    ASSERT_EQ(static_cast<int>(row.words.size()), word_count(row.spec.type));
    EXPECT_EQ(decode(row.spec, row.words), row.value);
    std::vector<std::uint16_t> words(row.words.size());
    ASSERT_TRUE(encode(row.spec, row.value, words)) << row.value;
    EXPECT_EQ(words, row.words) << row.value;
  }
}

// IEEE 754: 1.0f is 3F80 0000, -118.625f is C2ED 4000.
TEST(ModbusRegister, ReadsThePublishedPatternsOfFloats) {
  RegisterSpec spec;
  spec.type = RegisterType::f32;
  const std::array<std::uint16_t, 2> one = {0x3F80, 0x0000}, cold = {0xC2ED, 0x4000};
  EXPECT_EQ(decode(spec, one), 1.0);
  EXPECT_EQ(decode(spec, cold), -118.625);
  spec.order = WordOrder::cdab;
  const std::array<std::uint16_t, 2> swapped = {0x4000, 0xC2ED};
  EXPECT_EQ(decode(spec, swapped), -118.625);
}

TEST(ModbusRegister, ScalesAndRoundsToTheNearestStep) {
  RegisterSpec spec;
  spec.scale = 0.01;
  spec.offset = -10.0;
  std::array<std::uint16_t, 1> words{};
  ASSERT_TRUE(encode(spec, 2.5049, words));
  EXPECT_EQ(words[0], 1250);
  EXPECT_DOUBLE_EQ(decode(spec, words), 2.5);
  spec.scale = -0.5;
  spec.offset = 0.0;
  spec.type = RegisterType::i16;
  ASSERT_TRUE(encode(spec, 3.0, words));
  EXPECT_EQ(words[0], 0xFFFA);
}

// The limits of two's complement.
TEST(ModbusRegister, TakesEachIntegerToItsEndsAndNoFurther) {
  struct Ends {
    RegisterType type;
    double low, high;
  };
  for (const Ends& ends :
       {Ends{RegisterType::u16, 0.0, 65535.0}, Ends{RegisterType::i16, -32768.0, 32767.0},
        Ends{RegisterType::u32, 0.0, 4294967295.0},
        Ends{RegisterType::i32, -2147483648.0, 2147483647.0}}) {
    RegisterSpec spec;
    spec.type = ends.type;
    std::array<std::uint16_t, 2> words{};
    const auto view = std::span(words).first(static_cast<std::size_t>(word_count(ends.type)));
    for (const double whole : {ends.low, ends.high}) {
      ASSERT_TRUE(encode(spec, whole, view)) << whole;
      EXPECT_EQ(decode(spec, view), whole);
    }
    EXPECT_FALSE(encode(spec, ends.low - 1.0, view)) << ends.low;
    EXPECT_FALSE(encode(spec, ends.high + 1.0, view)) << ends.high;
  }
}

TEST(ModbusRegister, RoundTripsWithinItsResolution) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> value(0.0, 60.0), scale(0.001, 1.0);
  for (const auto& [type_name, type] : kTypes) {
    for (const auto& [order_name, order] : kOrders) {
      for (int i = 0; i < 200; ++i) {
        RegisterSpec spec;
        spec.type = type;
        spec.order = order;
        spec.scale =
            scale(random) *
            (i % 2 == 0 || type == RegisterType::u16 || type == RegisterType::u32 ? 1.0 : -1.0);
        const double wanted = value(random);
        std::array<std::uint16_t, 2> words{};
        const auto view = std::span(words).first(static_cast<std::size_t>(word_count(type)));
        if (!encode(spec, wanted, view)) continue;
        EXPECT_LE(std::abs(decode(spec, view) - wanted), resolution(spec, wanted))
            << type_name << ' ' << order_name;
      }
    }
  }
}

TEST(ModbusRegister, RefusesWhatDoesNotFitAndSaysWhatDoes) {
  RegisterSpec spec;
  spec.address = 12;
  spec.scale = 0.1;
  spec.unit = "Hz";
  std::array<std::uint16_t, 2> words = {7, 7};
  const auto one = std::span(words).first(1);
  const Result<void> high = encode(spec, 6553.6, one);
  ASSERT_FALSE(high);
  EXPECT_EQ(high.error().what,
            "register 12: 6553.6 Hz does not fit its u16: allowed is 0 to 6553.5");
  EXPECT_TRUE(encode(spec, 6553.54, one));
  EXPECT_FALSE(encode(spec, -0.06, one));
  EXPECT_TRUE(encode(spec, -0.04, one));
  spec.scale = 1.0;
  for (const auto& [name, type] : kTypes) {
    spec.type = type;
    words = {7, 7};
    const auto view = std::span(words).first(static_cast<std::size_t>(word_count(type)));
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), -1e300, 1e300}) {
      EXPECT_FALSE(encode(spec, bad, view)) << name << ' ' << bad;
    }
    EXPECT_EQ(words[0], 7) << "an error leaves the words alone";
  }
}

TEST(ModbusRegister, ReadsNotANumberAsSuch) {
  RegisterSpec spec;
  spec.type = RegisterType::f32;
  const std::array<std::uint16_t, 2> nan = {0x7FC0, 0x0000}, infinite = {0x7F80, 0x0000};
  EXPECT_TRUE(std::isnan(decode(spec, nan)));
  EXPECT_TRUE(std::isinf(decode(spec, infinite)));
}

TEST(ModbusRegister, GivesTheBitsOfAMaskWithoutScale) {
  RegisterSpec spec;
  spec.type = RegisterType::i32;
  spec.order = WordOrder::cdab;
  spec.scale = 0.001;
  const std::array<std::uint16_t, 2> words = {0x0002, 0x8001};
  EXPECT_EQ(bits(spec, words), 0x80010002U);
}

TEST(ModbusRegister, IsValidOnlyWithBothWordsInTheTable) {
  RegisterSpec spec;
  spec.address = 65535;
  EXPECT_TRUE(validate(spec));
  spec.type = RegisterType::f32;
  EXPECT_FALSE(validate(spec));
  spec.address = -1;
  EXPECT_FALSE(validate(spec));
  spec.address = 0;
  EXPECT_TRUE(validate(spec));
  spec.scale = 0.0;
  EXPECT_FALSE(validate(spec));
  spec.scale = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(validate(spec));
}

}  // namespace
}  // namespace shaker::protocol::modbus
