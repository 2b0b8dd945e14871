// What a table of a metering pin must be, and how a model file writes it. Private to config/.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "config/model.hpp"

namespace shaker::config {

// Why the table cannot be used, with the knots and the remedy; empty: it can.
std::string fault_of(const PinTable& table);
nlohmann::ordered_json as_json(const PinTable& table);

}  // namespace shaker::config
