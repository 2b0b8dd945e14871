#include "cli/campaign_place.hpp"

#include <fmt/format.h>

#include "record/campaign_files.hpp"

namespace shaker::cli {

bool is_database(const std::filesystem::path& file) {
  const auto extension = file.extension();
  return extension == ".db" || extension == ".sqlite";
}

Result<void> expect_file(const std::filesystem::path& path) {
  std::error_code none;  // what is not there is told by the reader
  if (!std::filesystem::is_directory(path, none)) return {};
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::invalid, fmt::format("{}: is a folder{}", path.string(), what)};
  };
  if (std::filesystem::exists(path / "campaign.json", none))
    return refuse(
        " with a recorded campaign, which `shakerctl diagnose` reads, and `estimate` with --model; "
        "here give a campaign database (.db), or one of its CSV files with --model and "
        "--frequency");
  const auto newest = record::find_campaign(path, "");
  if (!newest) return refuse(" without a campaign; give a campaign database (.db)");
  return refuse(
      fmt::format("; give one of its campaign databases, the newest is {}", newest->string()));
}

}  // namespace shaker::cli
