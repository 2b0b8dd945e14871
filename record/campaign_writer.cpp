// synchronous=FULL: a commit reaches the disk's own memory before it returns, so that a power
// failure loses no more than kill -9 does (NORMAL survives kill -9 only). docs/protocol.md
// gives the cost. A transaction is open from the first add to the next commit.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "base/unique_fd.hpp"
#include "record/campaign_files.hpp"
#include "record/checksums.hpp"
#include "record/database.hpp"
#include "record/file_parts.hpp"

namespace shaker::record {
namespace {

constexpr int kFoldWaitMs = 50;
constexpr std::size_t kBlock = 4096;  // largest number of samples in a row of `sample`

// 2026-03-01T12:00:00.123Z -> 20260301T120000Z
std::string compact_utc(const std::string& utc) {
  std::string digits;
  for (char c : utc.substr(0, 19)) {
    if (std::isalnum(static_cast<unsigned char>(c))) digits += c;
  }
  return digits + "Z";
}

// Creates a new file, so that two campaigns of the same second never share one.
Result<std::filesystem::path> create_file(const std::filesystem::path& directory,
                                          const CampaignRow& campaign) {
  std::error_code trouble;
  std::filesystem::create_directories(directory, trouble);
  const std::string stem = file_stem(campaign.name) + "_" + compact_utc(campaign.started_utc);
  for (int attempt = 1; attempt < 1000; ++attempt) {
    auto file = directory / (stem + (attempt == 1 ? "" : fmt::format("_{}", attempt)) + ".db");
    const UniqueFd fd(::open(file.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0640));
    if (fd.valid()) return file;
    if (errno != EEXIST) {
      return Error{
          ErrorKind::io,
          fmt::format("{}: cannot be created ({}); check that the data directory exists, has "
                      "space, and that this user may write in it.",
                      file.string(), std::generic_category().message(errno))};
    }
  }
  return Error{ErrorKind::exhausted,
               fmt::format("{}: a thousand campaigns named {} exist already; move some away.",
                           directory.string(), stem)};
}

}  // namespace

struct CampaignWriter::Impl {
  Impl(const std::filesystem::path& path)
      : file(path), database(path.string(), SQLite::OPEN_READWRITE, 2000) {}

  std::filesystem::path file;
  SQLite::Database database;
  std::vector<NamedFile> parts;  // as SQLite opened them; empty after the end of the campaign
  std::optional<SQLite::Statement> insert_run, insert_samples, insert_cycle, insert_document;
  std::vector<SampleRow> pending;  // samples of pending_run, not yet in a row
  int pending_run = -1;
  std::string blob;

  void lay_out(const CampaignRow& campaign, std::span<const Fact> facts) {
    add_row_sum(database);
    database.exec("PRAGMA journal_mode=WAL");
    database.exec("PRAGMA synchronous=FULL");
    // The log is folded into the file after this many pages: 16 MiB limit its size without
    // frequent stalls.
    database.exec("PRAGMA wal_autocheckpoint=4096");
    database.exec("BEGIN IMMEDIATE");
    database.exec(fmt::format("PRAGMA application_id={}", kApplicationId));
    database.exec(fmt::format("PRAGMA user_version={}", kSchemaVersion));
    database.exec(kSchema);
    database.exec(kFactTable);
    SQLite::Statement row(
        database,
        "INSERT INTO campaign(id, name, started_utc, rig, spec_json, model_json, crc) "
        "VALUES(1, ?1, ?2, ?3, ?4, ?5, row_sum(?1, ?2, ?3, ?4, ?5))");
    const std::array texts{&campaign.name, &campaign.started_utc, &campaign.rig,
                           &campaign.spec_json, &campaign.model_json};
    for (int i = 0; i < static_cast<int>(texts.size()); ++i) {
      row.bind(i + 1, *texts[static_cast<std::size_t>(i)]);
    }
    row.exec();
    SQLite::Statement channel(database,
                              "INSERT INTO channel VALUES(?1, ?2, ?3, row_sum(?1, ?2, ?3))");
    for (const auto& [id, label] : campaign.auxiliary) {
      channel.reset();
      channel.bind(1, static_cast<int>(id));
      channel.bind(2, label.name);
      channel.bind(3, label.unit);
      channel.exec();
    }
    for (const Fact& fact : facts)
      insert_fact(database, fact, campaign.started_utc);
    database.exec("COMMIT");
    insert_run.emplace(database,
                       "INSERT INTO run VALUES(?1, ?2, ?3, ?4, ?5, row_sum(?1, ?2, ?3, ?4, ?5))");
    insert_samples.emplace(
        database,
        "INSERT INTO sample(run, count, data, crc) VALUES(?1, ?2, ?3, row_sum(?1, ?2, ?3))");
    insert_cycle.emplace(database,
                         "INSERT INTO cycle VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, row_sum(?1, ?2, "
                         "?3, ?4, ?5, ?6, ?7, ?8))");
    insert_document.emplace(database, "INSERT INTO document VALUES(?1, ?2, row_sum(?1, ?2))");
    pending.reserve(kBlock);
    for (const char* suffix : {"", "-wal", "-shm"})
      parts.emplace_back(file.string() + suffix);
  }

  // A failed statement may have rolled the transaction back, so SQLite is asked for its state.
  void begin() {
    if (sqlite3_get_autocommit(database.getHandle()) != 0) database.exec("BEGIN IMMEDIATE");
  }

  void write_pending() {
    if (pending.empty()) return;
    begin();
    pack(pending, blob);
    insert_samples->reset();
    insert_samples->bind(1, pending_run);
    insert_samples->bind(2, static_cast<std::int64_t>(pending.size()));
    insert_samples->bindNoCopy(3, blob.data(), static_cast<int>(blob.size()));
    insert_samples->exec();
    pending.clear();
  }

  template <class Work>
  Result<void> guarded(Work&& work) {
    try {
      work();
      return {};
    } catch (const SQLite::Exception& trouble) {
      return describe(trouble, file);
    }
  }
};

CampaignWriter::CampaignWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CampaignWriter::CampaignWriter(CampaignWriter&&) noexcept = default;
CampaignWriter& CampaignWriter::operator=(CampaignWriter&&) noexcept = default;
CampaignWriter::~CampaignWriter() = default;

Result<CampaignWriter> CampaignWriter::create(const std::filesystem::path& directory,
                                              const CampaignRow& campaign,
                                              std::span<const Fact> facts) {
  const auto file = create_file(directory, campaign);
  if (!file) return file.error();
  try {
    auto impl = std::make_unique<Impl>(*file);
    impl->lay_out(campaign, facts);
    return CampaignWriter(std::move(impl));
  } catch (const SQLite::Exception& trouble) {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::filesystem::remove(file->string() + suffix, ignored);
    }
    return describe(trouble, *file);
  }
}

const std::filesystem::path& CampaignWriter::file() const {
  return impl_->file;
}

Result<void> CampaignWriter::add_run(const RunRow& run) {
  return impl_->guarded([&] {
    impl_->write_pending();
    impl_->begin();
    auto& row = *impl_->insert_run;
    row.reset();
    row.bind(1, run.index);
    row.bind(2, run.name);
    row.bind(3, run.frequency_hz);
    row.bind(4, run.amplitude);
    row.bind(5, run.cycles_wanted);
    row.exec();
  });
}

Result<void> CampaignWriter::add_samples(int run, std::span<const SampleRow> samples) {
  return impl_->guarded([&] {
    if (run != impl_->pending_run) impl_->write_pending();
    impl_->pending_run = run;
    while (!samples.empty()) {
      const auto part = std::min(samples.size(), kBlock - impl_->pending.size());
      impl_->pending.insert(impl_->pending.end(), samples.begin(), samples.begin() + part);
      samples = samples.subspan(part);
      if (impl_->pending.size() == kBlock) impl_->write_pending();
    }
  });
}

Result<void> CampaignWriter::add_cycle(const CycleRow& cycle) {
  return impl_->guarded([&] {
    impl_->begin();
    auto& row = *impl_->insert_cycle;
    row.reset();
    row.bind(1, cycle.run);
    row.bind(2, cycle.index);
    row.bind(3, cycle.accepted ? 1 : 0);
    row.bind(4, cycle.frequency_hz);
    row.bind(5, cycle.amplitude);
    const auto bind = [&](int index, const std::vector<double>& values) {
      // A null pointer would bind NULL; an empty channel is an empty blob.
      row.bindNoCopy(index, values.empty() ? static_cast<const void*>("") : values.data(),
                     static_cast<int>(values.size() * sizeof(double)));
    };
    bind(6, cycle.displacement);
    bind(7, cycle.excitation);
    row.bind(8, std::isfinite(cycle.excitation_error) ? cycle.excitation_error : 0.0);
    row.exec();
  });
}

Result<void> CampaignWriter::add_document(std::uint64_t seq, const std::string& line) {
  return impl_->guarded([&] {
    impl_->begin();
    auto& row = *impl_->insert_document;
    row.reset();
    row.bind(1, static_cast<std::int64_t>(seq));
    row.bindNoCopy(2, line);
    row.exec();
  });
}

Result<void> CampaignWriter::add_fact(const Fact& fact, const std::string& utc) {
  return impl_->guarded([&] {
    impl_->begin();
    insert_fact(impl_->database, fact, utc);
  });
}

Result<void> CampaignWriter::commit() {
  return impl_->guarded([&] {
    impl_->write_pending();
    if (sqlite3_get_autocommit(impl_->database.getHandle()) == 0) impl_->database.exec("COMMIT");
  });
}

Result<void> CampaignWriter::still_there() const {
  for (const NamedFile& part : impl_->parts) {
    if (part.still_named()) continue;
    return Error{ErrorKind::io,
                 fmt::format("{}: was removed, moved or replaced while the campaign was being "
                             "recorded; what is measured from now on is kept nowhere. Keep other "
                             "programs out of the data directory and start the campaign again.",
                             part.path())};
  }
  return {};
}

Result<void> CampaignWriter::finish(const std::string& status, const std::string& finished_utc) {
  return impl_->guarded([&] {
    impl_->write_pending();
    impl_->begin();
    SQLite::Statement row(impl_->database, "UPDATE campaign SET status = ?, finished_utc = ?");
    row.bind(1, status);
    row.bind(2, finished_utc);
    row.exec();
    impl_->database.exec("COMMIT");
    impl_->parts.clear();
    // Fold the log in, so that the campaign is one file. This fails while another process reads
    // the file; the next opening does it then. A long wait for that process would look like a disk
    // that does not answer.
    impl_->database.setBusyTimeout(kFoldWaitMs);
    impl_->database.tryExec("PRAGMA wal_checkpoint(TRUNCATE)");
    impl_->insert_run.reset();
    impl_->insert_samples.reset();
    impl_->insert_cycle.reset();
    impl_->insert_document.reset();
    impl_->database.tryExec("PRAGMA journal_mode=DELETE");
  });
}

}  // namespace shaker::record
