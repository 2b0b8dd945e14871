// A campaign on disk: one SQLite file (WAL) that stays consistent after kill -9 at any time.
//
// Tables: campaign (one row: name, started, model, spec as JSON), run, sample (blocks of raw
// samples), channel (names of the auxiliary channels), cycle (resampled), document (every
// published line), fact (where the numbers come from: provenance.hpp). user_version is the schema
// version: 1 has no table of channels, 2 no checksums of rows, 3 no facts. The daemon writes; shakerctl and drivers/replay read. One thread per
// object. Every call may wait for the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "protocol/channel.hpp"
#include "record/provenance.hpp"

namespace shaker::record {

struct RunRow {
  int index = 0;
  std::string name;
  double frequency_hz = 0.0, amplitude = 0.0;
  int cycles_wanted = 0;
};
struct SampleRow {
  std::int64_t t_ns = 0;
  double value = 0.0;
  protocol::Channel channel = protocol::Channel::displacement;
  std::uint8_t quality = 0;
};
// From the first to the second, s. Times of a damaged file wrap around; they never overflow.
inline double seconds_between(const SampleRow& first, const SampleRow& second) {
  return 1e-9 *
         static_cast<double>(static_cast<std::int64_t>(static_cast<std::uint64_t>(second.t_ns) -
                                                       static_cast<std::uint64_t>(first.t_ns)));
}
struct CycleRow {
  int run = 0;
  std::int64_t index = 0;
  bool accepted = false;
  double frequency_hz = 0.0, amplitude = 0.0;
  std::vector<double> displacement, excitation;
  // Standard error of the excitation's harmonics, m/s^2; 0 if it is exact or not in the file.
  // An estimate without it has standard errors that are too small.
  double excitation_error = 0.0;
};
struct CampaignRow {
  std::string name, started_utc, rig, spec_json, model_json, finished_utc, status;
  protocol::ChannelLabels auxiliary = {};
};

class CampaignWriter {
 public:
  // Creates `directory`/NAME_UTC.db. An Error names the file and the remedy (full disk,
  // permissions).
  static Result<CampaignWriter> create(const std::filesystem::path& directory,
                                       const CampaignRow& campaign,
                                       std::span<const Fact> facts = {});
  CampaignWriter(CampaignWriter&&) noexcept;
  CampaignWriter& operator=(CampaignWriter&&) noexcept;
  ~CampaignWriter();

  const std::filesystem::path& file() const;
  Result<void> add_run(const RunRow& run);
  // Buffered; durable at the next commit().
  Result<void> add_samples(int run, std::span<const SampleRow> samples);
  Result<void> add_cycle(const CycleRow& cycle);
  Result<void> add_document(std::uint64_t seq, const std::string& line);
  Result<void> add_fact(const Fact& fact, const std::string& utc);
  // When this returns, everything added before is on disk.
  Result<void> commit();
  // Returns an Error if the path of the file or of its log no longer names it (removed, moved,
  // replaced), because commits are then lost. Costs three look-ups of a path.
  Result<void> still_there() const;
  Result<void> finish(const std::string& status, const std::string& finished_utc);

 private:
  struct Impl;
  explicit CampaignWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

class CampaignReader {
 public:
  // An Error states whether the file is missing, not a campaign, of a newer version, or
  // damaged.
  static Result<CampaignReader> open(const std::filesystem::path& file);
  CampaignReader(CampaignReader&&) noexcept;
  CampaignReader& operator=(CampaignReader&&) noexcept;
  ~CampaignReader();

  Result<CampaignRow> campaign() const;
  Result<std::vector<RunRow>> runs() const;
  Result<std::vector<CycleRow>> cycles(int run) const;
  Result<std::vector<SampleRow>> samples(int run) const;
  // The samples of the last `span_s` seconds of a run, and up to a block more.
  Result<std::vector<SampleRow>> last_samples(int run, double span_s) const;
  Result<std::vector<std::string>> documents() const;
  Result<std::vector<Fact>> facts() const;  // in the order of their writing

 private:
  struct Impl;
  explicit CampaignReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::record
