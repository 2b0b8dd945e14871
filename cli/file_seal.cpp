#include "cli/file_seal.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <nettle/sha2.h>
#include <system_error>

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolderSeal = "campaign.sha256";
constexpr std::size_t kHashDigits = 64;

fs::path folder_of(const fs::path& campaign) {
  std::error_code none;
  return fs::is_directory(campaign, none) ? campaign : campaign.parent_path();
}

// The files of a campaign: its database, or everything in its folder.
std::vector<fs::path> files_of(const fs::path& campaign) {
  std::error_code trouble;
  if (!fs::is_directory(campaign, trouble)) return {campaign};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(campaign, trouble)) {
    if (entry.is_regular_file() && entry.path() != seal_of(campaign)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Nothing where the stream fails.
std::optional<std::string> sha256(std::istream& in) {
  sha256_ctx context;
  ::sha256_init(&context);
  std::array<char, 1 << 16> block{};
  if (!in.good()) return std::nullopt;
  while (in) {
    in.read(block.data(), block.size());
    ::sha256_update(&context, static_cast<std::size_t>(in.gcount()),
                    reinterpret_cast<const std::uint8_t*>(block.data()));
  }
  if (in.bad()) return std::nullopt;
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
  ::sha256_digest(&context, digest.size(), digest.data());
  std::string hash;
  for (const std::uint8_t byte : digest)
    hash += fmt::format("{:02x}", byte);
  return hash;
}

Result<std::string> seal_text(const fs::path& campaign) {
  const auto hashes = hashes_of(campaign);
  if (!hashes) return hashes.error();
  std::string text;
  for (const SealedFile& file : *hashes)
    text += file.hash + "  " + file.name + "\n";
  return text;
}

}  // namespace

Result<std::string> sha256_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  auto hash = sha256(in);
  if (!hash) return Error{ErrorKind::io, fmt::format("{}: cannot be read", file.string())};
  return *hash;
}

Result<std::string> fingerprint_of(const fs::path& campaign) {
  std::error_code none;
  if (!fs::is_directory(campaign, none)) return sha256_of(campaign);
  const auto text = seal_text(campaign);
  if (!text) return text.error();
  std::istringstream in(*text);
  return *sha256(in);
}

fs::path seal_of(const fs::path& campaign) {
  std::error_code none;
  if (fs::is_directory(campaign, none)) return campaign / kFolderSeal;
  return campaign.string() + ".sha256";
}

Result<std::vector<SealedFile>> hashes_of(const fs::path& campaign) {
  std::vector<SealedFile> hashes;
  for (const fs::path& file : files_of(campaign)) {
    auto hash = sha256_of(file);
    if (!hash) return hash.error();
    hashes.push_back({file.lexically_relative(folder_of(campaign)).string(), std::move(*hash)});
    if (hashes.back().name.empty()) hashes.back().name = file.filename().string();
  }
  return hashes;
}

Result<void> write_seal(const fs::path& campaign) {
  const auto text = seal_text(campaign);
  if (!text) return text.error();
  const fs::path seal = seal_of(campaign);
  std::error_code none;
  if (fs::exists(seal, none)) {
    const auto broken = broken_seal(campaign);
    if (broken && broken->empty()) return {};
    return Error{ErrorKind::invalid,
                 fmt::format("{}: is a seal that does not match; it is not replaced. Remove it "
                             "yourself if the campaign was changed on purpose",
                             seal.string())};
  }
  std::ofstream out(seal, std::ios::binary);
  out << *text;
  if (out.flush()) return {};
  return Error{ErrorKind::io,
               fmt::format("{}: cannot be written; check the folder's permissions", seal.string())};
}

Result<std::vector<std::string>> broken_seal(const fs::path& campaign) {
  const fs::path seal = seal_of(campaign);
  std::ifstream in(seal);
  std::map<std::string, std::string> sealed;
  for (std::string line; std::getline(in, line);) {
    if (line.size() < kHashDigits + 3 || line[kHashDigits] != ' ')
      return Error{
          ErrorKind::invalid,
          fmt::format("{}: is not a seal; a line is HASH, two blanks, NAME", seal.string())};
    sealed[line.substr(kHashDigits + 2)] = line.substr(0, kHashDigits);
  }
  if (sealed.empty())
    return Error{ErrorKind::io, fmt::format("{}: cannot be read, or is empty", seal.string())};
  const auto hashes = hashes_of(campaign);
  if (!hashes) return hashes.error();
  std::vector<std::string> broken;
  for (const SealedFile& file : *hashes) {
    const auto said = sealed.find(file.name);
    if (said == sealed.end())
      broken.push_back(fmt::format("{} was not there when it was sealed", file.name));
    else if (said->second != file.hash)
      broken.push_back(fmt::format("{} is not as it was sealed", file.name));
    if (said != sealed.end()) sealed.erase(said);
  }
  for (const auto& [name, hash] : sealed)
    broken.push_back(fmt::format("{} is missing", name));
  return broken;
}

}  // namespace shaker::cli
