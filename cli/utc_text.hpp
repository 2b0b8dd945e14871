// Times of files and documents for people. Pure; any thread.
#pragma once

#include <string>

namespace shaker::cli {

// "2026-03-01 12:00:00 UTC" from "2026-03-01T12:00:00.123Z"; other text as it is.
std::string readable_utc(const std::string& utc);

}  // namespace shaker::cli
