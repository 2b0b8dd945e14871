#include "record/campaign_files.hpp"

#include <algorithm>
#include <cctype>
#include <tuple>
#include <vector>

#include <fmt/format.h>

namespace shaker::record {
namespace {

constexpr std::size_t kUtc = 16;  // 20260301T120000Z

struct File {
  std::string utc;  // of its start; empty if the file was renamed
  std::filesystem::file_time_type written;
  std::string campaign;  // part of the stem before the time
  std::filesystem::path path;
  bool operator<(const File& other) const {
    return std::tie(utc, written, path) < std::tie(other.utc, other.written, other.path);
  }
};

bool is_utc(const std::string& text) {
  if (text.size() != kUtc || text[8] != 'T' || text.back() != 'Z') return false;
  return std::ranges::count_if(text, [](unsigned char c) { return std::isdigit(c) != 0; }) == 14;
}

// NAME_UTC or NAME_UTC_2.
File described(const std::filesystem::path& path) {
  std::error_code trouble;
  File file{"", std::filesystem::last_write_time(path, trouble), path.stem().string(), path};
  std::string stem = file.campaign;
  for (int last = 0; last < 2; ++last) {
    const auto bar = stem.rfind('_');
    if (bar == std::string::npos) return file;
    if (is_utc(stem.substr(bar + 1))) {
      file.utc = stem.substr(bar + 1);
      file.campaign = stem.substr(0, bar);
      return file;
    }
    stem.resize(bar);
  }
  return file;
}

}  // namespace

std::string file_stem(const std::string& campaign) {
  std::string stem = campaign.substr(0, 80);
  std::ranges::replace_if(
      stem,
      [](char c) { return !(std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_'); },
      '_');
  return stem.empty() ? "campaign" : stem;
}

Result<std::filesystem::path> find_campaign(const std::filesystem::path& directory,
                                            const std::string& name) {
  std::vector<File> found;
  std::error_code trouble;
  std::size_t all = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory, trouble)) {
    if (entry.path().extension() != ".db") continue;
    ++all;
    File file = described(entry.path());
    const std::string own = entry.path().filename().string();
    if (own == name || entry.path().stem().string() == name) return entry.path();
    if (name.empty() || file.campaign == file_stem(name)) found.push_back(std::move(file));
  }
  if (!found.empty()) return std::max_element(found.begin(), found.end())->path;
  if (trouble)
    return Error{ErrorKind::io, fmt::format("{}: {}.", directory.string(), trouble.message())};
  if (all == 0)
    return Error{ErrorKind::unavailable,
                 fmt::format("{} holds no campaign yet; run one first.", directory.string())};
  return Error{ErrorKind::unavailable,
               fmt::format("There is no campaign \"{}\" among the {} in {}; give its name, its "
                           "file's name, or nothing for the newest.",
                           name.substr(0, 96), all, directory.string())};
}

}  // namespace shaker::record
