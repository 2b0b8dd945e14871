#include "daemon/publish/recorder.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon/publish/journal.hpp"

namespace shaker::daemon {
Recorder::Recorder(RecorderOptions options, Clock& clock, Wake wake, Complete complete)
    : options_(std::move(options)),
      clock_(clock),
      wake_(std::move(wake)),
      complete_(std::move(complete)),
      progress_(clock.now().count()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Recorder::~Recorder() {
  thread_.request_stop();
  thread_.join();
}

bool Recorder::must_be_kept(std::string_view type) {
  return type == "cycle" || type == "estimate";
}

bool Recorder::must_be_kept(const protocol::Document& document) {
  return must_be_kept(protocol::type_name(document));
}

// --- the engine's thread

Result<record::CampaignWriter> Recorder::create(const config::CampaignSpec& campaign,
                                                const std::string& who) const {
  record::CampaignRow row;
  row.name = campaign.name;
  row.started_utc = format_utc(clock_.utc());
  row.rig = options_.rig;
  row.auxiliary = options_.auxiliary;
  row.model_json = config::to_json_text(campaign.model);
  row.spec_json = config::to_json_text(campaign);
  std::vector<record::Fact> facts = options_.facts;
  facts.push_back({"campaign", "sha256", record::sha256(row.spec_json)});
  facts.push_back({"model", "sha256", record::sha256(row.model_json)});
  if (!who.empty()) facts.push_back({"person", "started by", who});
  if (!campaign.resumes.empty()) facts.push_back({"campaign", "resumes", campaign.resumes});
  for (const auto& [name, value] : config::entries(campaign.specimen))
    facts.push_back({"specimen", name, value});
  return record::CampaignWriter::create(options_.directory, row, facts);
}

Result<void> Recorder::prepare(const config::CampaignSpec& campaign, const std::string& who) {
  auto writer = create(campaign, who);
  if (!writer) return writer.error();
  prepared_file_ = writer->file();
  const std::lock_guard lock(mutex_);
  prepared_ = std::move(*writer);
  return {};
}

void Recorder::discard() {
  std::optional<record::CampaignWriter> unused;
  {
    const std::lock_guard lock(mutex_);
    unused.swap(prepared_);
  }
  if (!unused) return;
  const std::filesystem::path file = unused->file();
  unused.reset();
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"})
    std::filesystem::remove(file.string() + part, ignored);
}

Result<void> Recorder::record_campaign(const config::CampaignSpec& campaign) {
  std::optional<record::CampaignWriter> writer;
  {
    const std::lock_guard lock(mutex_);
    if (stalled_ && (busy_ || !queue_.empty())) return *trouble_;
    writer.swap(prepared_);
  }
  if (!writer) {
    auto created = create(campaign, {});
    if (!created) return created.error();
    writer = std::move(*created);
  }
  spdlog::info("Campaign {} is recorded in {}.", campaign.name, writer->file().string());
  {
    const std::lock_guard lock(mutex_);
    trouble_.reset();
    stalled_ = false;
  }
  open_ = true;
  run_ = -1;
  status_.clear();
  return hand_over(Begin{std::move(*writer)}, 0);
}

Result<void> Recorder::record_run(int run_index, const config::RunSpec& run) {
  run_ = run_index;
  return hand_over(record::RunRow{run_index, run.name, run.frequency_hz, run.amplitude, run.cycles},
                   256);
}

Result<void> Recorder::record_samples(std::span<const drivers::Sample> samples) {
  if (!open_ || samples.empty()) return {};
  const std::lock_guard lock(mutex_);
  if (trouble_) return *trouble_;
  const std::size_t bytes = samples.size() * sizeof(record::SampleRow);
  if (waiting_bytes_ + bytes > options_.max_waiting) {
    trouble_ =
        Error{ErrorKind::exhausted,
              fmt::format("{}: the disk does not keep up ({} bytes wait to be written); use a "
                          "faster disk, or find what else uses it.",
                          options_.directory.string(), waiting_bytes_)};
    return *trouble_;
  }
  waiting_bytes_ += bytes;
  Samples* last = queue_.empty() ? nullptr : std::get_if<Samples>(&queue_.back());
  if (!last || last->run != run_) {
    queue_.push_back(Samples{run_, {}});
    last = &std::get<Samples>(queue_.back());
  }
  for (const drivers::Sample& sample : samples) {
    last->rows.push_back({sample.t.count(), sample.value, sample.channel,
                          static_cast<std::uint8_t>(sample.quality)});
  }
  return {};
}

Result<void> Recorder::record_cycle(const estimator::MeasuredCycle& cycle, bool accepted) {
  if (!open_) return {};
  const std::size_t bytes = (cycle.displacement.size() + cycle.excitation.size()) * sizeof(double);
  return hand_over(
      record::CycleRow{cycle.run, cycle.index, accepted, cycle.frequency_hz, cycle.amplitude,
                       cycle.displacement, cycle.excitation, cycle.excitation_error},
      bytes);
}

void Recorder::close_campaign() {
  if (!open_) return;
  open_ = false;
  // Earlier calls have reported any failure already.
  if (!hand_over(
          Finish{status_.empty() ? "abort" : status_, format_utc(clock_.utc()), state_reason_},
          0)) {
    spdlog::error("The campaign's database was closed early.");
  }
}

Result<void> Recorder::publish(const protocol::Document& document) {
  log_document(document, logged_state_);
  Waiting waiting = stamped(document);
  if (auto* health = std::get_if<protocol::HealthDocument>(&waiting.document)) {
    if (complete_) complete_(*health);
    const std::lock_guard lock(mutex_);
    health->disk_flush_max_s = seconds(std::exchange(flush_max_, Nanoseconds{}));
  }
  if (const auto* state = std::get_if<protocol::StateDocument>(&document))
    state_reason_ = state->reason;
  // The status of the campaign is that of its worst run.
  if (const auto* stop = std::get_if<protocol::RunStopDocument>(&document)) {
    if (status_.empty() || stop->status == "fail" || status_ == "success") status_ = stop->status;
  }
  if (stalled_) {
    if (!must_be_kept(document)) publish_past_the_disk(std::move(waiting));
    return healthy();
  }
  return hand_over(std::move(waiting), 1024);
}

// The document is in no file; an alarm states the reason.
void Recorder::publish_past_the_disk(Waiting waiting) {
  {
    const std::lock_guard lock(mutex_);
    std::vector<Waiting> alone;
    alone.push_back(std::move(waiting));
    std::ranges::move(numbered(alone), std::back_inserter(published_));
  }
  wake_();
}

// Publishes the documents behind a call to the disk that does not return, except those that
// must be kept. Call with the lock held.
void Recorder::let_pass() {
  for (PublishedLine& line : in_flight_) {
    if (!must_be_kept(line.type)) published_.push_back(std::move(line));
  }
  in_flight_.clear();
  for (Item& item : queue_) {
    if (auto* waiting = std::get_if<Waiting>(&item)) documents_.push_back(std::move(*waiting));
  }
  std::erase_if(queue_, [](const Item& item) { return std::holds_alternative<Waiting>(item); });
  std::erase_if(documents_, [](const Waiting& w) { return must_be_kept(w.document); });
  std::ranges::move(numbered(documents_), std::back_inserter(published_));
  documents_.clear();
  wake_();
}

Result<void> Recorder::healthy() {
  const std::lock_guard lock(mutex_);
  const Nanoseconds still = clock_.now() - last_progress();
  if (busy_ && still > options_.stall && !stalled_) {
    stalled_ = true;
    let_pass();
    trouble_ =
        Error{ErrorKind::timeout,
              fmt::format("{}: the disk has not answered for {:.1f} s; what was acknowledged "
                          "is kept, the rest is lost: look at the disk and its mount.",
                          options_.directory.string(), seconds(still))};
  }
  if (trouble_) return *trouble_;
  return {};
}

Recorder::Waiting Recorder::stamped(const protocol::Document& document) const {
  return {document, format_utc(clock_.utc()), clock_.now().count()};
}

Result<void> Recorder::hand_over(Item item, std::size_t bytes) {
  std::optional<Error> trouble;
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(item));
    waiting_bytes_ += bytes;
    urgent_ = true;
    trouble = trouble_;
  }
  ready_.notify_one();
  if (trouble) return *trouble;
  return {};
}

// --- any thread

std::vector<PublishedLine> Recorder::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(published_, {});
}

bool Recorder::idle() const {
  const std::lock_guard lock(mutex_);
  return queue_.empty() && !busy_;
}

}  // namespace shaker::daemon
