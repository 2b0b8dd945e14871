// The linear oscillator (6.2), the oleo (6.3) and the oleo on its tyre for parameterised tests,
// with the results of independent code (tests/data/three_models/reference.py).
#pragma once

#include <filesystem>
#include <fstream>
#include <ostream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::testing {

struct OneOfThree {
  const char* name;
  config::ModelSpec (*spec)();
  int points;  // of the grid; the tyre's own motion is fast

  nlohmann::json known() const {
    std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "three_models/reference.json");
    return nlohmann::json::parse(file).at(name);
  }
};

inline void PrintTo(const OneOfThree& one, std::ostream* out) {
  *out << one.name;
}

inline auto three_models(int points, int points_of_tyre) {
  return ::testing::Values(OneOfThree{"linear", [] { return linear_oscillator(); }, points},
                           OneOfThree{"oleo", [] { return oleo(); }, points},
                           OneOfThree{"tyre", [] { return oleo_on_tyre(0.1); }, points_of_tyre});
}

inline std::string name_of(const ::testing::TestParamInfo<OneOfThree>& one) {
  return one.param.name;
}

}  // namespace shaker::estimator::testing
