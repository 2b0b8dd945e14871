// Tables and numbers as plain text for people. Pure; any thread.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace shaker::report {

// Columns with two blanks between them; the first row is the header and is underlined. A column
// is left-aligned, or right-aligned where `right` is true. Widths count characters, not bytes
// of UTF-8.
std::string text_table(const std::vector<std::vector<std::string>>& rows,
                       const std::vector<bool>& right);

// "16.671 ± 0.024": the error has two digits, the value as many decimals. Without a finite
// error the value is alone and has six digits; a value that is not finite becomes "-".
std::string with_error(double value, double standard_error);

// `value` with as many decimals as show `scale` (an error or a width) with two digits.
std::string rounded_to(double value, double scale);

// "1 min 20 s", "35 s", "2 h 05 min".
std::string duration(double seconds);

// "1 run", "2 runs".
std::string counted(std::size_t count, const std::string& what);

}  // namespace shaker::report
