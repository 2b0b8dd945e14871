#include "record/provenance.hpp"

#include <array>

#include <fmt/format.h>
#include <nettle/sha2.h>

#include "record/checksums.hpp"
#include "record/database.hpp"

namespace shaker::record {

std::string sha256(std::string_view text) {
  sha256_ctx context;
  ::sha256_init(&context);
  std::vector<std::uint8_t> bytes(text.begin(), text.end());
  ::sha256_update(&context, bytes.size(), bytes.data());
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
  ::sha256_digest(&context, digest.size(), digest.data());
  std::string hexadecimal;
  for (const std::uint8_t byte : digest)
    hexadecimal += fmt::format("{:02x}", byte);
  return hexadecimal;
}

bool holds(const Fact& fact) {
  return fact.sha256 == sha256(fact.value);
}

void insert_fact(SQLite::Database& database, const Fact& fact, const std::string& utc) {
  SQLite::Statement row(database,
                        "INSERT INTO fact(kind, name, value, utc, sha256, crc) "
                        "VALUES(?1, ?2, ?3, ?4, ?5, row_sum(?1, ?2, ?3, ?4, ?5))");
  row.bind(1, fact.kind);
  row.bind(2, fact.name);
  row.bind(3, fact.value);
  row.bind(4, fact.utc.empty() ? utc : fact.utc);
  row.bind(5, sha256(fact.value));
  row.exec();
}

Result<void> add_note(const std::filesystem::path& file, const Fact& note) {
  auto database = open_campaign(file, true, false);
  if (!database) return database.error();
  try {
    // A writer beside the recorder could make it wait, and the table would ramp down.
    const std::string status = (*database)->execAndGet("SELECT status FROM campaign").getString();
    if (status == "running") {
      return Error{ErrorKind::refused,
                   fmt::format("{}: the campaign is still being recorded; add the note when it has "
                               "ended. If its daemon has died, start the daemon first, which "
                               "closes the file.",
                               file.string())};
    }
    add_row_sum(**database);
    SQLite::Transaction transaction(**database);
    (*database)->exec(kFactTable);
    insert_fact(**database, note, note.utc);
    transaction.commit();
    return {};
  } catch (const SQLite::Exception& trouble) {
    return describe(trouble, file);
  }
}

}  // namespace shaker::record
