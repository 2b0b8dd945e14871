// Tables and numbers for people, as plain text. Pure; any thread.
#pragma once

#include <string>
#include <vector>

namespace shaker::report {

// Columns aligned with two blanks between them; the first row is the head, underlined.
// Left-aligned, or right-aligned where `right` says so. Widths count characters, not bytes of
// UTF-8.
std::string text_table(const std::vector<std::vector<std::string>>& rows,
                       const std::vector<bool>& right);

// "16.671 ± 0.024": the error with two digits, the value with as many decimals. Without a finite
// error the value has six digits and stands alone; a value that is not finite is "-".
std::string with_error(double value, double standard_error);

// As many decimals as `scale` (an error or a width) makes worth reading.
std::string rounded_to(double value, double scale);

// "1 min 20 s", "35 s", "2 h 05 min".
std::string duration(double seconds);

}  // namespace shaker::report
