// Prints a page of HTML to PDF by a program that is there: weasyprint, or Chromium.
#pragma once

#include <filesystem>

#include "base/result.hpp"

namespace shaker::cli {

// Blocks until the program ends, a minute at most. An Error says which programs were looked for, or
// that one failed.
Result<void> print_page(const std::filesystem::path& html, const std::filesystem::path& pdf);

}  // namespace shaker::cli
