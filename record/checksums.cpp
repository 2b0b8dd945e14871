#include "record/checksums.hpp"

#include <array>
#include <bit>
#include <string_view>

#include <fmt/format.h>
#include <sqlite3.h>

#include "record/database.hpp"

namespace shaker::record {
namespace {

struct Summed {
  const char *table, *columns;
};
constexpr Summed kSummed[] = {
    {"campaign", "name, started_utc, rig, spec_json, model_json"},
    {"run", "idx, name, frequency_hz, amplitude, cycles_wanted"},
    {"sample", "run, count, data"},
    {"channel", "id, name, unit"},
    {"cycle",
     "run, idx, accepted, frequency_hz, amplitude, displacement, excitation, excitation_error"},
    {"document", "seq, line"},
    {"fact", "kind, name, value, utc, sha256"}};

constexpr auto kCrcTable = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t sum = i;
    for (int bit = 0; bit < 8; ++bit)
      sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xedb88320U : 0U);
    table[i] = sum;
  }
  return table;
}();

std::uint32_t crc(std::uint32_t sum, std::string_view bytes) {
  for (const char byte : bytes)
    sum = (sum >> 8) ^ kCrcTable[(sum ^ static_cast<unsigned char>(byte)) & 0xff];
  return sum;
}

std::uint32_t crc_of_word(std::uint32_t sum, std::uint64_t word) {
  std::array<char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<char>(word >> (8 * i) & 0xff);
  return crc(sum, {bytes.data(), bytes.size()});
}

std::uint32_t crc_of_value(std::uint32_t sum, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  sum = crc_of_word(sum, static_cast<std::uint64_t>(type));
  if (type == SQLITE_INTEGER)
    return crc_of_word(sum, static_cast<std::uint64_t>(sqlite3_value_int64(value)));
  if (type == SQLITE_FLOAT)  // SQLite keeps -0.0 as 0.0
    return crc_of_word(sum, std::bit_cast<std::uint64_t>(sqlite3_value_double(value) + 0.0));
  const void* bytes = type == SQLITE_TEXT ? sqlite3_value_text(value) : sqlite3_value_blob(value);
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
  sum = crc_of_word(sum, size);
  return bytes == nullptr ? sum : crc(sum, {static_cast<const char*>(bytes), size});
}

void row_sum(sqlite3_context* context, int count, sqlite3_value** values) {
  std::uint32_t sum = 0xffffffffU;
  for (int i = 0; i < count; ++i)
    sum = crc_of_value(sum, values[i]);
  sqlite3_result_int64(context, static_cast<sqlite3_int64>(sum ^ 0xffffffffU));
}

std::string unsound(const Summed& rows) {
  return fmt::format("FROM {} WHERE crc IS NOT row_sum({})", rows.table, rows.columns);
}

bool has_sums(SQLite::Database& database) {
  return database.execAndGet("PRAGMA user_version").getInt() >= kSummedVersion;
}

}  // namespace

void add_row_sum(SQLite::Database& database) {
  const int outcome = sqlite3_create_function_v2(database.getHandle(), "row_sum", -1,
                                                 SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr,
                                                 row_sum, nullptr, nullptr, nullptr);
  if (outcome != SQLITE_OK) throw SQLite::Exception(database.getHandle(), outcome);
}

std::int64_t unsound_rows(SQLite::Database& database) {
  if (!has_sums(database)) return 0;
  std::int64_t count = 0;
  for (const Summed& rows : kSummed) {
    if (!database.tableExists(rows.table)) continue;  // `fact` came later than the sums
    count += database.execAndGet("SELECT count(*) " + unsound(rows)).getInt64();
  }
  return count;
}

void drop_unsound_rows(SQLite::Database& database) {
  if (!has_sums(database)) return;
  for (const Summed& rows : kSummed) {
    if (std::string_view(rows.table) == "campaign" || !database.tableExists(rows.table)) continue;
    database.exec("DELETE " + unsound(rows));
  }
}

}  // namespace shaker::record
