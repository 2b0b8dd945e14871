// Units of length that are known by name, in a model's `length_unit` and in a campaign's units.
#pragma once

#include <optional>
#include <string>

namespace shaker::config {

// Metres in one of them, or nothing.
std::optional<double> metres(const std::string& unit);

}  // namespace shaker::config
