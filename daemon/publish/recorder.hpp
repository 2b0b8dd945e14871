// The engine's Outlet: records, commits, and publishes only after that.
//
// The engine's thread hands items over and never waits for the disk, except where
// record_campaign creates the file itself. The recorder's own thread writes the items in order,
// commits those that have accumulated (one flush for many), and then passes the documents to
// the clients' loop (`take`). Therefore every document that a client has seen is on disk.
//
// If the disk fails, the campaign's file is closed with the committed data. Cycles and
// estimates are then withheld because they cannot be kept, other documents are still published,
// and `healthy` returns the Error, so that the engine ramps down. A call to the disk that does
// not return within `stall` is a failure too; from then on documents that need not be kept are
// published without it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "base/clock.hpp"
#include "daemon/outlet.hpp"
#include "daemon/publish/stream_server.hpp"
#include "daemon/workers/wave_box.hpp"
#include "record/campaign_database.hpp"

namespace shaker::daemon {

struct RecorderOptions {
  std::filesystem::path directory;  // for the databases
  std::string rig;
  protocol::ChannelLabels auxiliary = {};      // of the rig file, stored in every campaign
  std::vector<record::Fact> facts = {};        // of rig and programs, stored in every campaign
  std::size_t max_waiting = 64 * 1024 * 1024;  // bytes not yet on disk
  // Limit of one call to the disk. The service sets half of the time that withholds the
  // heartbeat.
  Nanoseconds stall = std::chrono::seconds(1);
  WaveBox* waves = nullptr;  // gets every cycle that was not accepted; outlives the recorder
};

class Recorder final : public Outlet {
 public:
  // `wake` is called whenever `take` has documents, on the recorder's or the engine's thread.
  // `complete` is called on the engine's thread and fills in what only the service knows of a
  // health document.
  using Wake = std::function<void()>;
  using Complete = std::function<void(protocol::HealthDocument&)>;
  Recorder(RecorderOptions options, Clock& clock, Wake wake, Complete complete);
  ~Recorder() override;  // writes and commits everything that was handed over

  // Creates the campaign's file for the next record_campaign. Call it on any thread but the
  // engine's, which must not wait for the disk. Without it record_campaign creates the file
  // itself. `who` starts it.
  Result<void> prepare(const config::CampaignSpec& campaign, const std::string& who = {});
  // The file that was prepared last; empty before the first. On the thread of `prepare`.
  const std::filesystem::path& prepared_file() const { return prepared_file_; }
  void discard();  // removes a prepared file that was not used

  // --- Outlet, on the engine's thread
  Result<void> record_campaign(const config::CampaignSpec& campaign) override;
  Result<void> record_run(int run_index, const config::RunSpec& run) override;
  Result<void> record_samples(std::span<const drivers::Sample> samples) override;
  Result<void> record_cycle(const estimator::MeasuredCycle& cycle, bool accepted) override;
  void close_campaign() override;
  Result<void> publish(const protocol::Document& document) override;
  Result<void> healthy() override;

  // --- any thread
  // Documents that may be published now, in order.
  std::vector<PublishedLine> take();
  bool idle() const;  // nothing is waiting
  // Time at which its thread last returned from the disk or looked for work. Takes no lock.
  Nanoseconds last_progress() const { return Nanoseconds(progress_.load()); }
  std::uint64_t disk_free_bytes() const { return disk_free_.load(); }
  const std::filesystem::path& directory() const { return options_.directory; }

 private:
  struct Begin {
    record::CampaignWriter writer;
  };
  struct Samples {
    int run = 0;
    std::vector<record::SampleRow> rows;
  };
  struct Finish {
    std::string status, utc, reason;
  };
  struct Waiting {
    protocol::Document document;
    std::string utc;
    std::int64_t mono_ns = 0;
  };
  using Item = std::variant<Begin, record::RunRow, Samples, record::CycleRow, Finish, Waiting>;

  static bool must_be_kept(std::string_view type);
  static bool must_be_kept(const protocol::Document& document);

  Result<record::CampaignWriter> create(const config::CampaignSpec& campaign,
                                        const std::string& who) const;
  Result<void> hand_over(Item item, std::size_t bytes);
  void publish_past_the_disk(Waiting waiting);
  Waiting stamped(const protocol::Document& document) const;

  // --- recorder_thread.cpp
  void work(const std::stop_token& stop);
  void write(std::size_t count);
  void apply(Item& item);
  void keep(const Result<void>& outcome);
  void show(record::CycleRow& cycle);
  void commit();
  std::vector<PublishedLine> numbered(const std::vector<Waiting>& documents);
  void let_pass();
  void store(const std::vector<PublishedLine>& lines);
  void look_at_the_disk();
  void fail(const Error& error);
  void advance();

  RecorderOptions options_;
  Clock& clock_;
  Wake wake_;
  Complete complete_;

  std::filesystem::path prepared_file_;  // the thread of `prepare`

  // the engine's thread
  bool open_ = false;
  int run_ = -1;
  std::string status_;        // of the worst run so far; empty before the first one ends
  std::string state_reason_;  // of the last state
  std::string logged_state_;  // the last state in the log

  // shared
  mutable std::mutex mutex_;
  std::condition_variable_any ready_;
  std::deque<Item> queue_;
  std::vector<Waiting> documents_;        // to be written at the next commit
  std::vector<PublishedLine> in_flight_;  // being written
  std::size_t waiting_bytes_ = 0;
  bool urgent_ = false, busy_ = false;
  std::optional<Error> trouble_;
  std::vector<PublishedLine> published_;
  std::uint64_t seq_ = 0;  // number of the last document
  Nanoseconds flush_max_{};
  std::optional<record::CampaignWriter> prepared_;
  std::atomic<bool> stalled_{false};  // the disk failed while a call to it was running
  std::atomic<std::int64_t> progress_{0};
  std::atomic<std::uint64_t> disk_free_{0};

  // the recorder's thread
  std::optional<record::CampaignWriter> writer_;
  bool dirty_ = false;
  bool failed_ = false;  // this campaign can no longer be recorded
  Nanoseconds next_look_{};

  std::jthread thread_;  // last member: starts after all others exist
};

}  // namespace shaker::daemon
