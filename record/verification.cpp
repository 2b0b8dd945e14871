#include "record/verification.hpp"

#include <array>
#include <fstream>
#include <map>

#include <fmt/format.h>

#include "record/campaign_check.hpp"
#include "record/checksums.hpp"
#include "record/database.hpp"

namespace shaker::record {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderBytes = 100;

std::uint32_t big_endian(const std::array<unsigned char, kHeaderBytes>& header, std::size_t at) {
  return static_cast<std::uint32_t>(header[at]) << 24 |
         static_cast<std::uint32_t>(header[at + 1]) << 16 |
         static_cast<std::uint32_t>(header[at + 2]) << 8 | header[at + 3];
}

// What SQLite does not check of its header (sqlite.org/fileformat2.html, 1.3).
void check_header(const fs::path& file, std::vector<std::string>& troubles) {
  std::array<unsigned char, kHeaderBytes> header{};
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(header.data()), kHeaderBytes)) {
    troubles.emplace_back("its header cannot be read");
    return;
  }
  const std::uint64_t stated = header[16] << 8 | header[17];
  const std::uint64_t page = stated == 1 ? 65536 : stated;
  std::error_code none;
  if (page * big_endian(header, 28) != fs::file_size(file, none))
    troubles.emplace_back("its size is not that of its header");
  if (big_endian(header, 24) != big_endian(header, 92))
    troubles.emplace_back("its header was written by something else than SQLite");
  for (std::size_t at = 72; at < 92; ++at) {
    if (header[at] == 0) continue;
    troubles.emplace_back("a reserved byte of its header is not 0");
    break;
  }
}

// Every statement that laid out the file, by the name of what it made.
std::map<std::string, std::string> layout_of(SQLite::Database& database) {
  std::map<std::string, std::string> layout;
  SQLite::Statement rows(database, "SELECT name, coalesce(sql, '') FROM sqlite_schema");
  while (rows.executeStep())
    layout[rows.getColumn(0).getString()] = rows.getColumn(1).getString();
  return layout;
}

// A note gives the layout before the newest one its table of facts, which then holds notes only.
bool got_notes(SQLite::Database& database, int version) {
  return version == kSchemaVersion - 1 &&
         database.execAndGet("SELECT count(*) FROM fact WHERE kind <> 'note'").getInt64() == 0;
}

void check_layout(SQLite::Database& database, std::vector<std::string>& troubles) {
  SQLite::Database expected(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  expected.exec(kSchema);
  expected.exec(kFactTable);
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  const bool same = layout_of(database) == layout_of(expected);
  const bool fits = version == kSchemaVersion ? same : !same || got_notes(database, version);
  if (!fits) troubles.emplace_back("its tables are not those of its layout's version");
}

void check_gaps(SQLite::Database& database, const VerifiedCampaign& found,
                std::vector<std::string>& troubles) {
  const auto expect = [&](const char* sql, const char* sentence) {
    if (database.execAndGet(sql).getInt64() != 0) troubles.emplace_back(sentence);
  };
  expect("SELECT coalesce(max(id), 0) - count(*) FROM sample", "blocks of samples are missing");
  expect("SELECT coalesce(max(idx) + 1, 0) - count(*) FROM run", "runs are missing");
  expect("SELECT coalesce(max(seq) - min(seq) + 1, 0) - count(*) FROM document",
         "documents are missing");
  expect("SELECT count(*) FROM cycle WHERE run NOT IN (SELECT idx FROM run)",
         "cycles belong to no run");
  SQLite::Statement row(database, "SELECT started_utc, finished_utc, status FROM campaign");
  if (!row.executeStep()) {
    troubles.emplace_back("it does not say which campaign it is");
    return;
  }
  const std::string started = row.getColumn(0).getString(), finished = row.getColumn(1).getString();
  const bool in_time = finished.size() == started.size() && finished >= started;
  if (!found.running && !in_time) troubles.emplace_back("it does not end after it began");
}

void count(SQLite::Database& database, VerifiedCampaign& found) {
  const Recovered contents = counted(database);
  found.runs = contents.runs;
  found.samples = contents.samples;
  found.cycles = contents.cycles;
  found.documents = contents.documents;
  found.running = database.execAndGet("SELECT status FROM campaign").getString() == "running";
  found.summed = database.execAndGet("PRAGMA user_version").getInt() >= kSummedVersion;
}

void check_rows(SQLite::Database& database, std::vector<std::string>& troubles) {
  add_row_sum(database);
  const std::int64_t unsound = unsound_rows(database);
  if (unsound > 0)
    troubles.push_back(fmt::format("{} {} not match {} checksum", unsound,
                                   unsound == 1 ? "row does" : "rows do",
                                   unsound == 1 ? "its" : "their"));
}

}  // namespace

Result<VerifiedCampaign> verify_campaign(const fs::path& file) {
  auto opened = open_campaign(file, false, false);
  if (!opened) return opened.error();
  SQLite::Database& database = **opened;
  VerifiedCampaign found;
  try {
    if (!holds_bytes(file.string() + "-wal")) check_header(file, found.troubles);
    const std::string verdict = database.execAndGet("PRAGMA integrity_check(1)").getString();
    if (verdict != "ok") found.troubles.push_back("its structure is damaged: " + verdict);
    check_layout(database, found.troubles);
    count(database, found);
    check_rows(database, found.troubles);
    check_gaps(database, found, found.troubles);
  } catch (const SQLite::Exception& trouble) {
    found.troubles.push_back(fmt::format("it cannot be read to its end ({})", trouble.what()));
  }
  return found;
}

}  // namespace shaker::record
