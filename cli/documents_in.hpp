// Documents as they came from the daemon: back into structs, and into sentences for people.
//
// A field that is missing or of another type gets its default: a newer daemon may say more, an
// older one less, and neither may stop an operator from watching. Pure.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "protocol/documents.hpp"

namespace shaker::cli {

// A number that was left out (it was not finite) comes back as NaN.
protocol::EstimateDocument estimate_from(const nlohmann::json& document);

// Members with a default, whatever the type of what is there.
std::string text_of(const nlohmann::json& document, const char* key);
std::optional<double> number_of(const nlohmann::json& document, const char* key);
bool flag_of(const nlohmann::json& document, const char* key);

// One line without the line break, e.g. "cycle 7 of slow accepted: 1.5001 Hz, 2.49 m/s^2". Control
// characters are replaced, so that nothing that came in steers the terminal. Empty for what is not
// worth a line (health).
std::string narrate(const nlohmann::json& document);

// Blanks in place of control characters.
std::string printable(std::string text);

}  // namespace shaker::cli
