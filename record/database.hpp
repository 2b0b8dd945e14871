// The layout of a campaign's SQLite file, and the code that reader and writer share: opening,
// checking, and messages for errors. Private to record/.
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
#include "record/provenance.hpp"

namespace shaker::record {

inline constexpr int kApplicationId = 0x5348414b;  // "SHAK", in the file's header
inline constexpr int kSchemaVersion = 4;
inline constexpr int kSummedVersion = 3;  // first version with checksums of rows
extern const char* const kSchema;         // without the table of facts
extern const char* const kFactTable;      // no effect where it exists

// Adds a row of `fact`, with the time `utc` where the fact has none. Needs row_sum (checksums.hpp).
// Throws SQLite::Exception.
void insert_fact(SQLite::Database& database, const Fact& fact, const std::string& utc);

// Converts an exception of SQLite to an Error that names the file and the remedy.
Error describe(const SQLite::Exception& trouble, const std::filesystem::path& file);

// The Error is `invalid` if this is not a campaign or is damaged, and `refused` if it is newer.
// With `thorough`, checks every page. Throws SQLite::Exception.
Result<void> check_campaign(SQLite::Database& database, const std::filesystem::path& file,
                            bool thorough);

// Opens an existing campaign. The Error is `invalid` if the file is missing, not a campaign or
// damaged, `refused` if it is newer, and of other kinds if the disk or another program refuses
// it. With `thorough`, checks every page (about a second for each gigabyte).
Result<std::unique_ptr<SQLite::Database>> open_campaign(const std::filesystem::path& file,
                                                        bool writable, bool thorough);

// Samples in a blob, 18 bytes each, little-endian.
inline constexpr std::size_t kPackedSample = 18;
void pack(std::span<const SampleRow> samples, std::string& blob);
// Returns false if the blob is not a whole number of samples of known channels.
bool unpack(std::span<const std::byte> blob, std::vector<SampleRow>& samples);

std::span<const std::byte> bytes_of(const SQLite::Column& column);

}  // namespace shaker::record
