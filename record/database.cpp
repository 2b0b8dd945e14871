#include "record/database.hpp"

#include <bit>
#include <cstring>

#include <fmt/format.h>
#include <sqlite3.h>
#include <system_error>

namespace shaker::record {

static_assert(std::endian::native == std::endian::little,
              "blobs are written as they lie in memory");

const char* const kSchema = R"sql(
  CREATE TABLE campaign(
    id INTEGER PRIMARY KEY CHECK(id = 1),
    name TEXT NOT NULL, started_utc TEXT NOT NULL, rig TEXT NOT NULL,
    spec_json TEXT NOT NULL, model_json TEXT NOT NULL,
    finished_utc TEXT NOT NULL DEFAULT '', status TEXT NOT NULL DEFAULT 'running', crc INTEGER) STRICT;
  CREATE TABLE run(
    idx INTEGER PRIMARY KEY, name TEXT NOT NULL,
    frequency_hz REAL NOT NULL, amplitude REAL NOT NULL, cycles_wanted INTEGER NOT NULL,
    crc INTEGER) STRICT;
  CREATE TABLE sample(
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL, count INTEGER NOT NULL,
    data BLOB NOT NULL, crc INTEGER) STRICT;
  CREATE TABLE channel(
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, unit TEXT NOT NULL, crc INTEGER) STRICT;
  CREATE INDEX sample_by_run ON sample(run);
  CREATE TABLE cycle(
    run INTEGER NOT NULL, idx INTEGER NOT NULL, accepted INTEGER NOT NULL,
    frequency_hz REAL NOT NULL, amplitude REAL NOT NULL,
    displacement BLOB NOT NULL, excitation BLOB NOT NULL,
    excitation_error REAL NOT NULL DEFAULT 0, crc INTEGER, PRIMARY KEY(run, idx)) STRICT;
  CREATE TABLE document(seq INTEGER PRIMARY KEY, line TEXT NOT NULL, crc INTEGER) STRICT;
)sql";

const char* const kFactTable = R"sql(
  CREATE TABLE IF NOT EXISTS fact(
    id INTEGER PRIMARY KEY, kind TEXT NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL,
    utc TEXT NOT NULL, sha256 TEXT NOT NULL, crc INTEGER) STRICT;
)sql";

Error describe(const SQLite::Exception& trouble, const std::filesystem::path& file) {
  const std::string name = file.string();
  switch (trouble.getErrorCode()) {
    case SQLITE_FULL:
      return {ErrorKind::exhausted,
              fmt::format("{}: the disk is full; free space on it (or choose another data "
                          "directory) and start the campaign again. Everything that was committed "
                          "before is kept.",
                          name)};
    case SQLITE_IOERR:
      return {
          ErrorKind::io,
          fmt::format("{}: the disk refused to write or read ({}, code {}); check free space, "
                      "quota and the disk itself. Everything that was committed before is kept.",
                      name, trouble.getErrorStr(), trouble.getExtendedErrorCode())};
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return {ErrorKind::io,
              fmt::format("{}: cannot be opened for this ({}); check that the directory exists and "
                          "that this user may write in it.",
                          name, trouble.what())};
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorKind::unavailable,
              fmt::format("{}: another program holds it; close that program and try again.", name)};
    case SQLITE_NOTADB:
      return {ErrorKind::invalid,
              fmt::format("{}: is not a campaign database; give the .db file that shakerd wrote.",
                          name)};
    case SQLITE_CORRUPT:
      return {ErrorKind::invalid, fmt::format("{}: is damaged ({}); what can be saved comes out of "
                                              "`sqlite3 FILE .recover`.",
                                              name, trouble.what())};
    default:
      return {ErrorKind::io, fmt::format("{}: {} (SQLite code {}).", name, trouble.what(),
                                         trouble.getExtendedErrorCode())};
  }
}

Result<void> check_campaign(SQLite::Database& database, const std::filesystem::path& file,
                            bool thorough) {
  const int id = database.execAndGet("PRAGMA application_id").getInt();
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (id != kApplicationId) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: is an SQLite file, but not a campaign database; give the .db file "
                    "that shakerd wrote.",
                    file.string())};
  }
  if (version > kSchemaVersion) {
    return Error{
        ErrorKind::refused,
        fmt::format("{}: was written by a newer shakerd (layout {}, this program reads up to "
                    "{}); install that version to read it.",
                    file.string(), version, kSchemaVersion)};
  }
  if (thorough) {
    const std::string verdict = database.execAndGet("PRAGMA quick_check(1)").getString();
    if (verdict != "ok") {
      return Error{ErrorKind::invalid,
                   fmt::format("{}: is damaged ({}); what can be saved comes out "
                               "of `sqlite3 FILE .recover`.",
                               file.string(), verdict)};
    }
  }
  return {};
}

Result<std::unique_ptr<SQLite::Database>> open_campaign(const std::filesystem::path& file,
                                                        bool writable, bool thorough) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: there is no such file; the daemon's campaigns are in its data "
                             "directory.",
                             file.string())};
  }
  try {
    auto database = std::make_unique<SQLite::Database>(
        file.string(), writable ? SQLite::OPEN_READWRITE : SQLite::OPEN_READONLY, 2000);
    if (auto good = check_campaign(*database, file, thorough); !good) return good.error();
    return database;
  } catch (const SQLite::Exception& trouble) {
    return describe(trouble, file);
  }
}

void pack(std::span<const SampleRow> samples, std::string& blob) {
  blob.resize(samples.size() * kPackedSample);
  char* out = blob.data();
  for (const SampleRow& sample : samples) {
    std::memcpy(out, &sample.t_ns, 8);
    std::memcpy(out + 8, &sample.value, 8);
    out[16] = static_cast<char>(sample.channel);
    out[17] = static_cast<char>(sample.quality);
    out += kPackedSample;
  }
}

bool unpack(std::span<const std::byte> blob, std::vector<SampleRow>& samples) {
  if (blob.size() % kPackedSample != 0) return false;
  samples.reserve(samples.size() + blob.size() / kPackedSample);
  for (; !blob.empty(); blob = blob.subspan(kPackedSample)) {
    SampleRow sample;
    std::memcpy(&sample.t_ns, blob.data(), 8);
    std::memcpy(&sample.value, blob.data() + 8, 8);
    const auto channel = std::to_integer<int>(blob[16]);
    if (channel >= protocol::kChannelCount) return false;
    sample.channel = static_cast<protocol::Channel>(channel);
    sample.quality = std::to_integer<std::uint8_t>(blob[17]);
    samples.push_back(sample);
  }
  return true;
}

std::span<const std::byte> bytes_of(const SQLite::Column& column) {
  const int size = column.getBytes();
  return {static_cast<const std::byte*>(column.getBlob()), static_cast<std::size_t>(size)};
}

}  // namespace shaker::record
