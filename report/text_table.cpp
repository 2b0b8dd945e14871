#include "report/text_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace shaker::report {
namespace {

std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;  // not a continuation byte
  }));
}

// The number of decimals that show `scale` with two digits.
int decimals(double scale) {
  return std::max(0, 1 - static_cast<int>(std::floor(std::log10(scale))));
}

bool wants_exponent(double value, double scale) {
  const double size = std::max(std::abs(value), scale);
  return size >= 1e6 || size < 1e-3 || decimals(scale) > 9;
}

}  // namespace

std::string text_table(const std::vector<std::vector<std::string>>& rows,
                       const std::vector<bool>& right) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], width(row[i]));
  }
  std::string out;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    for (std::size_t i = 0; i < rows[r].size(); ++i) {
      const std::string& cell = rows[r][i];
      const std::string pad(widths[i] - width(cell), ' ');
      line += (i ? "  " : "") + (i < right.size() && right[i] ? pad + cell : cell + pad);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
    if (r > 0) continue;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      out += (i ? "  " : "") + std::string(widths[i], '-');
    }
    out += "\n";
  }
  return out;
}

std::string rounded_to(double value, double scale) {
  if (!std::isfinite(value)) return "-";
  if (!std::isfinite(scale) || scale <= 0.0) return fmt::format("{:.6g}", value);
  if (!wants_exponent(value, scale)) return fmt::format("{:.{}f}", value, decimals(scale));
  const double size = std::max(std::abs(value), scale);
  const int digits = static_cast<int>(std::floor(std::log10(size)) - std::floor(std::log10(scale)));
  return fmt::format("{:.{}e}", value, std::clamp(digits + 1, 1, 15));
}

std::string with_error(double value, double standard_error) {
  const std::string text = rounded_to(value, standard_error);
  if (!std::isfinite(value) || !std::isfinite(standard_error) || standard_error <= 0.0) return text;
  return fmt::format("{} ± {}", text,
                     wants_exponent(value, standard_error)
                         ? fmt::format("{:.1e}", standard_error)
                         : fmt::format("{:.{}f}", standard_error, decimals(standard_error)));
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0.0) return "-";
  const auto whole = static_cast<long>(std::lround(std::min(seconds, 1e9)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string counted(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace shaker::report
