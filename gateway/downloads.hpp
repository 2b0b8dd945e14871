// Campaigns and reports in the daemon's directory, for download. Reads only.
//
// A file is found by comparing its name with those in the directory, so that no name can lead
// out of it. A campaign that is being recorded is listed and not given: its file is not whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "base/unique_fd.hpp"

namespace shaker::gateway {

struct Download {
  UniqueFd fd;
  std::uint64_t bytes = 0;
};

class Downloads {
 public:
  // An empty directory: there is nothing to download.
  explicit Downloads(std::filesystem::path directory) : directory_(std::move(directory)) {}

  // {"campaigns": [{"name", "bytes", "modified_utc", "recording", "report"}]}, newest first, at
  // most 200.
  nlohmann::json list() const;
  std::optional<Download> campaign(std::string_view name) const;  // "NAME.db"
  std::optional<Download> report(std::string_view name) const;    // "NAME.html"

 private:
  std::filesystem::path directory_;
};

}  // namespace shaker::gateway
