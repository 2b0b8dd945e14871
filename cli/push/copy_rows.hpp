// Rows in the text format of PostgreSQL's COPY. Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shaker::cli {

// Valid UTF-8 without NUL, which PostgreSQL refuses; U+FFFD in place of what is not.
std::string storable_text(std::string_view text);

class CopyRows {
 public:
  // One field after the other, then end_row().
  CopyRows& text(std::string_view value);  // stored as storable_text()
  CopyRows& number(double value);          // also inf and nan
  CopyRows& number(std::optional<double> value);
  CopyRows& count(std::int64_t value);
  CopyRows& flag(bool value);
  CopyRows& array(const std::vector<double>& values);
  CopyRows& null();
  void end_row();

  const std::string& bytes() const { return bytes_; }
  std::int64_t rows() const { return rows_; }

 private:
  CopyRows& field(std::string_view escaped);
  std::string bytes_;
  std::int64_t rows_ = 0;
  bool within_row_ = false;
};

}  // namespace shaker::cli
