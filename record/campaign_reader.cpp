#include <cstring>

#include <fmt/format.h>

#include "record/database.hpp"

namespace shaker::record {

struct CampaignReader::Impl {
  std::filesystem::path file;
  std::unique_ptr<SQLite::Database> database;

  Error damaged(const char* what) const {
    return {ErrorKind::invalid, fmt::format("{}: is damaged ({}); what can be saved comes out of "
                                            "`sqlite3 FILE .recover`.",
                                            file.string(), what)};
  }

  template <class Rows, class Work>
  Result<Rows> query(Work&& work) const {
    try {
      return work();
    } catch (const SQLite::Exception& trouble) {
      return describe(trouble, file);
    }
  }
};

namespace {

std::vector<double> doubles(const SQLite::Column& column) {
  const auto bytes = bytes_of(column);
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
  return values;
}

protocol::ChannelLabels labels(SQLite::Database& database) {
  protocol::ChannelLabels found;
  if (!database.tableExists("channel")) return found;
  SQLite::Statement row(database, "SELECT id, name, unit FROM channel ORDER BY id");
  while (row.executeStep()) {
    const int id = row.getColumn(0).getInt();
    if (id < 0 || id >= protocol::kChannelCount) continue;
    found[static_cast<protocol::Channel>(id)] = {row.getColumn(1).getString(),
                                                 row.getColumn(2).getString()};
  }
  return found;
}

}  // namespace

CampaignReader::CampaignReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CampaignReader::CampaignReader(CampaignReader&&) noexcept = default;
CampaignReader& CampaignReader::operator=(CampaignReader&&) noexcept = default;
CampaignReader::~CampaignReader() = default;

Result<CampaignReader> CampaignReader::open(const std::filesystem::path& file) {
  auto database = open_campaign(file, false, true);
  if (!database) return database.error();
  return CampaignReader(std::make_unique<Impl>(Impl{file, std::move(*database)}));
}

Result<CampaignRow> CampaignReader::campaign() const {
  return impl_->query<CampaignRow>([&]() -> Result<CampaignRow> {
    SQLite::Statement row(
        *impl_->database,
        "SELECT name, started_utc, rig, spec_json, model_json, finished_utc, status "
        "FROM campaign");
    if (!row.executeStep()) return impl_->damaged("it holds no campaign");
    const auto text = [&](int i) { return row.getColumn(i).getString(); };
    return CampaignRow{text(0), text(1), text(2), text(3),
                       text(4), text(5), text(6), labels(*impl_->database)};
  });
}

Result<std::vector<RunRow>> CampaignReader::runs() const {
  using Rows = std::vector<RunRow>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    Rows rows;
    SQLite::Statement row(
        *impl_->database,
        "SELECT idx, name, frequency_hz, amplitude, cycles_wanted FROM run ORDER BY idx");
    while (row.executeStep()) {
      rows.push_back({row.getColumn(0).getInt(), row.getColumn(1).getString(),
                      row.getColumn(2).getDouble(), row.getColumn(3).getDouble(),
                      row.getColumn(4).getInt()});
    }
    return rows;
  });
}

Result<std::vector<CycleRow>> CampaignReader::cycles(int run) const {
  using Rows = std::vector<CycleRow>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    Rows rows;
    const bool error_kept =
        impl_->database
            ->execAndGet(
                "SELECT COUNT(*) FROM pragma_table_info('cycle') WHERE name = 'excitation_error'")
            .getInt() > 0;
    SQLite::Statement row(
        *impl_->database,
        fmt::format("SELECT idx, accepted, frequency_hz, amplitude, displacement, excitation, {} "
                    "FROM cycle WHERE run = ? ORDER BY idx",
                    error_kept ? "excitation_error" : "0.0"));
    row.bind(1, run);
    while (row.executeStep()) {
      rows.push_back({run, row.getColumn(0).getInt64(), row.getColumn(1).getInt() != 0,
                      row.getColumn(2).getDouble(), row.getColumn(3).getDouble(),
                      doubles(row.getColumn(4)), doubles(row.getColumn(5)),
                      row.getColumn(6).getDouble()});
    }
    return rows;
  });
}

Result<std::vector<SampleRow>> CampaignReader::samples(int run) const {
  using Rows = std::vector<SampleRow>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    Rows rows;
    SQLite::Statement row(*impl_->database, "SELECT data FROM sample WHERE run = ? ORDER BY id");
    row.bind(1, run);
    while (row.executeStep()) {
      if (!unpack(bytes_of(row.getColumn(0)), rows)) return impl_->damaged("a block of samples");
    }
    return rows;
  });
}

Result<std::vector<SampleRow>> CampaignReader::last_samples(int run, double span_s) const {
  using Rows = std::vector<SampleRow>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    std::vector<Rows> blocks;  // last block first
    SQLite::Statement row(*impl_->database,
                          "SELECT data FROM sample WHERE run = ? ORDER BY id DESC");
    row.bind(1, run);
    while (row.executeStep()) {
      Rows block;
      if (!unpack(bytes_of(row.getColumn(0)), block)) return impl_->damaged("a block of samples");
      if (block.empty()) continue;
      blocks.push_back(std::move(block));
      if (seconds_between(blocks.back().front(), blocks.front().back()) > span_s) break;
    }
    Rows rows;
    for (auto block = blocks.rbegin(); block != blocks.rend(); ++block)
      rows.insert(rows.end(), block->begin(), block->end());
    return rows;
  });
}

Result<std::vector<std::string>> CampaignReader::documents() const {
  using Rows = std::vector<std::string>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    Rows rows;
    SQLite::Statement row(*impl_->database, "SELECT line FROM document ORDER BY seq");
    while (row.executeStep())
      rows.push_back(row.getColumn(0).getString());
    return rows;
  });
}

Result<std::vector<Fact>> CampaignReader::facts() const {
  using Rows = std::vector<Fact>;
  return impl_->query<Rows>([&]() -> Result<Rows> {
    Rows rows;
    if (!impl_->database->tableExists("fact")) return rows;
    SQLite::Statement row(*impl_->database,
                          "SELECT kind, name, value, utc, sha256 FROM fact ORDER BY id");
    const auto text = [&](int i) { return row.getColumn(i).getString(); };
    while (row.executeStep())
      rows.push_back({text(0), text(1), text(2), text(3), text(4)});
    return rows;
  });
}

}  // namespace shaker::record
