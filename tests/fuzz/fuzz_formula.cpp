// Any text as a formula (first line) and as the rate of a state (second line) in a model file:
// the result is an effect, or a sentence.
#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "estimator/model/formula/formula_effect.hpp"
#include "tests/fuzz/target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(text.find('\n'), text.size());
  shaker::config::EffectSpec spec;
  spec.effect = "fuzz";
  spec.formula = text.substr(0, end);
  if (end < text.size()) spec.states["z"].rate = text.substr(end + 1);
  spec.parameters["f"].start = 0.3;
  spec.parameters["k"].start = 5e-4;
  spec.constants["e"] = 0.001;
  try {
    if (!shaker::estimator::make_formula_effect(spec)) std::abort();
  } catch (const std::invalid_argument& error) {
    if (std::string(error.what()).empty()) std::abort();
  }
  return 0;
}
