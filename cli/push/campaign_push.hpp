// One campaign database into the tables of a PostgreSQL server (layout.hpp).
//
// Rows that are there already are not sent again, so that a push may be repeated, and continued
// where it was interrupted. The server never shows a part of a run's cycles or of a batch.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "cli/push/copy_rows.hpp"
#include "cli/push/postgres_link.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

// Makes the tables where there are none, and chooses `schema` for this connection. Precondition:
// is_schema_name(schema). An Error says that the tables are those of a newer program, or that the
// user may not make them.
Result<void> prepare_tables(PostgresLink& server, const std::string& schema);

struct PushedCampaign {
  std::string id;         // of its row in `campaign`
  bool complete = false;  // the campaign has ended, and all of it is there
  // Rows that were added.
  std::int64_t runs = 0, cycles = 0, estimates = 0, alarms = 0, facts = 0;
};

class CampaignPush {
 public:
  CampaignPush(PostgresLink& server, std::filesystem::path file)
      : server_(server), file_(std::move(file)) {}
  // Once. Reads also a database that is still written.
  Result<PushedCampaign> push();
  // After an Error: it is the file's; otherwise it is the server's.
  bool at_file() const { return at_file_; }

 private:
  using Keys = std::set<std::pair<std::int64_t, std::int64_t>>;
  struct Content {
    record::CampaignRow campaign;
    std::vector<record::RunRow> runs;
    std::vector<record::Fact> facts;
    std::vector<nlohmann::json> estimates, alarms;
  };

  Result<Content> read(const record::CampaignReader& reader) const;
  Result<void> find_or_add(const Content& content);
  Result<void> lock();
  Result<Keys> keys(const std::string& columns, const std::string& table);
  Result<void> add(const std::string& into, const CopyRows& rows, std::int64_t& added);
  Result<void> add_runs(const Content& content);
  Result<void> add_cycles(const record::CampaignReader& reader, const Content& content);
  Result<void> add_estimates(const Content& content);
  Result<void> add_batch(const CopyRows& estimates, const CopyRows& parameters);
  Result<void> add_alarms(const Content& content);
  Result<void> add_facts(const Content& content);
  Result<void> close(const Content& content);

  PostgresLink& server_;
  std::filesystem::path file_;
  bool at_file_ = false;
  PushedCampaign pushed_;
};

}  // namespace shaker::cli
