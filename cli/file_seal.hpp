// A seal: the SHA-256 of every byte of a campaign, in a file beside it that `sha256sum --check` reads
// too. FILE.db has FILE.db.sha256; a folder has campaign.sha256 in it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

struct SealedFile {
  std::string name;  // as in the seal: relative to its folder
  std::string hash;  // 64 hexadecimal digits
};

// The SHA-256 of a file's content. An Error names a file that cannot be read.
Result<std::string> sha256_of(const std::filesystem::path& file);

// Where the seal of a campaign is.
std::filesystem::path seal_of(const std::filesystem::path& campaign);

// The hashes of all files of a campaign, sorted by name, without the seal.
Result<std::vector<SealedFile>> hashes_of(const std::filesystem::path& campaign);

// One hash for a campaign: that of its database, or that of the seal of its folder.
Result<std::string> fingerprint_of(const std::filesystem::path& campaign);

// Writes the seal. An Error if there is one already that says otherwise: it is not replaced.
Result<void> write_seal(const std::filesystem::path& campaign);

// What does not match the seal, as sentences. An Error if the seal cannot be read.
Result<std::vector<std::string>> broken_seal(const std::filesystem::path& campaign);

}  // namespace shaker::cli
