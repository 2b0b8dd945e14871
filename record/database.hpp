// The layout of a campaign's SQLite file, and what both sides of it share: opening, checking, and
// the sentences for what can go wrong. Private to record/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <SQLiteCpp/SQLiteCpp.h>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::record {

inline constexpr int kApplicationId = 0x5348414b;  // "SHAK", in the file's header
inline constexpr int kSchemaVersion = 3;
inline constexpr int kSummedVersion = 3;  // the first whose rows have checksums
extern const char* const kSchema;

// What SQLite said, as a sentence that names the file and the remedy.
Error describe(const SQLite::Exception& trouble, const std::filesystem::path& file);

// An Error tells apart: not a campaign, damaged (both `invalid`), newer (`refused`). With
// `thorough`, every page is checked. Throws SQLite::Exception.
Result<void> check_campaign(SQLite::Database& database, const std::filesystem::path& file,
                            bool thorough);

// Opens an existing campaign. An Error tells apart: missing, not a campaign, damaged (all
// `invalid`), newer (`refused`), and what the disk or another program refuses. With `thorough`,
// every page is checked (about a second for each gigabyte).
Result<std::unique_ptr<SQLite::Database>> open_campaign(const std::filesystem::path& file,
                                                        bool writable, bool thorough);

// Samples as they stand in a blob, 18 bytes each, little-endian.
inline constexpr std::size_t kPackedSample = 18;
void pack(std::span<const SampleRow> samples, std::string& blob);
// Returns false when the blob is not a whole number of known samples.
bool unpack(std::span<const std::byte> blob, std::vector<SampleRow>& samples);

std::span<const std::byte> bytes_of(const SQLite::Column& column);

}  // namespace shaker::record
