// A client's file may be as large as kFileBytesMax and contain anything. The work must grow
// linearly with the size: eight times the entries cost eight times the work, not 64 times as
// with pairwise comparison. Measured is the CPU time of this thread, the smallest of several
// trials, so that a busy machine and sanitizers have little influence.
#include <algorithm>
#include <ctime>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/json_tree.hpp"
#include "config/model.hpp"
#include "config/rig.hpp"

namespace shaker::config {
namespace {

constexpr int kMany = 80000, kFew = kMany / 8;
constexpr double kLinearAtMost = 24.0;

double cpu_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Hostile {
  const char* name;
  std::function<std::string(int n)> text;
  std::function<void(const std::string& text)> read;
};

std::string repeated(int n, const std::function<std::string(int)>& item) {
  std::string out;
  for (int i = 0; i < n; ++i)
    out += (i ? "," : "") + item(i);
  return out;
}
std::string member(int i) {
  return "\"k" + std::to_string(i) + "\":0";
}

const Hostile kHostile[] = {
    {"keys", [](int n) { return "{" + repeated(n, member) + "}"; },
     [](const std::string& text) { EXPECT_TRUE(parse_json(text, "f")); }},
    {"unknown keys of a rig", [](int n) { return "{" + repeated(n, member) + "}"; },
     [](const std::string& text) { EXPECT_FALSE(parse_rig(text, "f")); }},
    {"parameters of a simulated rig",
     [](int n) {
       return R"({"name":"r","exciter":{"device":{"kind":"simulated"}},"sensors":[{"kind":)"
              R"("simulated","parameters":{)" +
              repeated(n, member) + "}}]}";
     },
     [](const std::string& text) { EXPECT_TRUE(parse_rig(text, "f")); }},
    {"constants of an effect",
     [](int n) {
       return R"({"name":"m","effects":[{"effect":"e","constants":{)" + repeated(n, member) +
              "}}]}";
     },
     [](const std::string& text) { EXPECT_TRUE(parse_model(text, "f")); }},
};

void PrintTo(const Hostile& hostile, std::ostream* out) {
  *out << hostile.name;
}

class Growth : public testing::TestWithParam<Hostile> {};

TEST_P(Growth, GoesWithTheSize) {
  const auto least = [&](int n) {
    const std::string text = GetParam().text(n);
    EXPECT_LE(text.size(), kFileBytesMax);
    double best = 1e9;
    for (int trial = 0; trial < 3; ++trial) {
      const double from = cpu_seconds();
      GetParam().read(text);
      best = std::min(best, cpu_seconds() - from);
    }
    return best;
  };
  const double few = least(kFew), many = least(kMany);
  EXPECT_LT(many / few, kLinearAtMost) << few << " s and " << many << " s";
}
INSTANTIATE_TEST_SUITE_P(Files, Growth, testing::ValuesIn(kHostile),
                         [](const auto& made) { return "Text" + std::to_string(made.index); });

TEST(Entries, AreNotReadBeyondTheirBound) {
  const auto effects = parse_model(
      R"({"name":"m","effects":[)" +
          repeated(201, [](int i) { return "{\"effect\":\"e" + std::to_string(i) + "\"}"; }) + "]}",
      "f");
  ASSERT_FALSE(effects);
  EXPECT_EQ(effects.error().what, "f:1: /effects: has 201 entries; at most 200 are read");
  const auto coordinates =
      parse_model(R"({"name":"m","effects":[{"effect":"e"}],"coordinates":[)" +
                      repeated(101, [](int i) { return "\"c" + std::to_string(i) + "\""; }) + "]}",
                  "f");
  ASSERT_FALSE(coordinates);
  EXPECT_THAT(coordinates.error().what,
              testing::HasSubstr("/coordinates: has 101 entries; at most 100 are read"));
}

}  // namespace
}  // namespace shaker::config
