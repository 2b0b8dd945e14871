// Is a campaign's file as it was written? Checks what a file says of itself: the header, every page,
// the tables, and the checksum of every row. Changes nothing.
//
// Bytes on which no content depends (the rest of a page, what SQLite left behind) have no checksum.
// Only a hash over the whole file knows them (cli/file_seal.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::record {

struct VerifiedCampaign {
  bool running = false;  // no end is written: the daemon is still at it, or it died
  bool summed = false;   // its rows have checksums (layout 3 and later)
  std::int64_t runs = 0, samples = 0, cycles = 0, documents = 0;
  std::vector<std::string> troubles;  // sentences; empty: everything fits
};

// Reads every byte of the content: about a second for each gigabyte. An Error if the file is no
// campaign or cannot be read at all.
Result<VerifiedCampaign> verify_campaign(const std::filesystem::path& file);

}  // namespace shaker::record
