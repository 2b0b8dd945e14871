// An output file that appears under its name only when it is complete. It is written as
// NAME.part.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "base/result.hpp"

namespace shaker::cli {

class OutFile {
 public:
  explicit OutFile(std::filesystem::path name);
  ~OutFile();  // removes an unfinished file
  OutFile(const OutFile&) = delete;
  OutFile& operator=(const OutFile&) = delete;

  template <class... Args>
  void write(fmt::format_string<Args...> format, Args&&... args) {
    if (file_) fmt::print(file_.get(), format, std::forward<Args>(args)...);
  }
  // For a library that writes the file itself, by the name part(): call close() first, then
  // finish().
  const std::string& part() const { return part_; }
  void close() { file_.reset(); }
  // Completes the file and gives it its name. An Error names the file and the reason.
  Result<void> finish();

 private:
  Error trouble() const;
  std::filesystem::path name_;
  std::string part_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  bool finished_ = false;
};

}  // namespace shaker::cli
