// Reads documents from the daemon: back into structs, and into sentences for people.
//
// A field that is missing or has another type gets its default value. A newer daemon may send
// more and an older one less; neither must keep an operator from watching. The functions are
// pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "protocol/documents.hpp"

namespace shaker::cli {

// A number that is absent, because it was not finite, becomes NaN.
protocol::EstimateDocument estimate_from(const nlohmann::json& document);

// A member, or its default value when it is absent or has another type.
std::string text_of(const nlohmann::json& document, const char* key);
std::optional<double> number_of(const nlohmann::json& document, const char* key);
std::int64_t count_of(const nlohmann::json& document, const char* key);
bool flag_of(const nlohmann::json& document, const char* key);

// One line without a line break, for example "cycle 7 of slow accepted: 1.5001 Hz, 2.49 m/s^2".
// Control characters become blanks, so that a document cannot control the terminal. Empty for
// documents that need no line (health).
std::string narrate(const nlohmann::json& document);

// Replaces control characters by blanks.
std::string printable(std::string text);

}  // namespace shaker::cli
