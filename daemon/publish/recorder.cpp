#include "daemon/publish/recorder.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kSamplesWait = 500ms;  // raw samples alone are committed at least so often

bool must_be_kept(const protocol::Document& document) {
  return std::holds_alternative<protocol::CycleDocument>(document) ||
         std::holds_alternative<protocol::EstimateDocument>(document);
}

// What an operator looks for in the journal afterwards. A state is told again as it progresses;
// `last` holds the last one that was logged.
void log(const protocol::Document& document, std::string& last) {
  if (const auto* alarm = std::get_if<protocol::AlarmDocument>(&document)) {
    const auto level = alarm->severity == "error"     ? spdlog::level::err
                       : alarm->severity == "warning" ? spdlog::level::warn
                                                      : spdlog::level::info;
    spdlog::log(level, "{}: {}", alarm->code, alarm->text);
  } else if (const auto* state = std::get_if<protocol::StateDocument>(&document)) {
    const std::string line = state->state + ": " + state->reason;
    if (line != last) spdlog::info("{}", line);
    last = line;
  } else if (const auto* stop = std::get_if<protocol::RunStopDocument>(&document)) {
    spdlog::info("Run {} of {} ended: {}, {}", stop->run, stop->campaign, stop->status,
                 stop->reason);
  } else if (const auto* found = std::get_if<protocol::DiagnosisResultDocument>(&document)) {
    spdlog::info("Diagnosis of {}: {}, {}", found->campaign, found->status, found->reason);
  }
}

}  // namespace

Recorder::Recorder(RecorderOptions options, Clock& clock, Wake wake, Complete complete)
    : options_(std::move(options)),
      clock_(clock),
      wake_(std::move(wake)),
      complete_(std::move(complete)),
      progress_(clock.now()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Recorder::~Recorder() {
  thread_.request_stop();
  thread_.join();
}

// --- the engine's thread

Result<void> Recorder::record_campaign(const config::CampaignSpec& campaign) {
  record::CampaignRow row;
  row.name = campaign.name;
  row.started_utc = format_utc(clock_.utc());
  row.rig = options_.rig;
  row.auxiliary = options_.auxiliary;
  row.model_json = config::to_json_text(campaign.model);
  row.spec_json = config::to_json_text(campaign);
  auto writer = record::CampaignWriter::create(options_.directory, row);
  if (!writer) return writer.error();
  spdlog::info("Campaign {} is recorded in {}.", campaign.name, writer->file().string());
  {
    const std::lock_guard lock(mutex_);
    trouble_.reset();
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
  // What there is to say about a failure has been said by the calls before.
  if (!hand_over(Finish{status_.empty() ? "abort" : status_, format_utc(clock_.utc())}, 0)) {
    spdlog::error("The campaign's database was closed early.");
  }
}

Result<void> Recorder::publish(const protocol::Document& document) {
  log(document, logged_state_);
  Waiting waiting = stamped(document);
  if (auto* health = std::get_if<protocol::HealthDocument>(&waiting.document)) {
    if (complete_) complete_(*health);
    const std::lock_guard lock(mutex_);
    health->disk_flush_max_s = seconds(std::exchange(flush_max_, Nanoseconds{}));
  }
  // The campaign ends as its worst run did.
  if (const auto* stop = std::get_if<protocol::RunStopDocument>(&document)) {
    if (status_.empty() || stop->status == "fail" || status_ == "success") status_ = stop->status;
  }
  return hand_over(std::move(waiting), 1024);
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

Nanoseconds Recorder::last_progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

// --- the recorder's thread

void Recorder::work(const std::stop_token& stop) {
  while (true) {
    std::vector<Item> items;
    {
      std::unique_lock lock(mutex_);
      ready_.wait_for(lock, stop, kSamplesWait, [this] { return urgent_; });
      if (stop.stop_requested() && queue_.empty()) break;
      items.swap(queue_);
      waiting_bytes_ = 0;
      urgent_ = false;
      busy_ = !items.empty();
      progress_ = clock_.now();
    }
    if (!items.empty()) write(std::move(items));
    const std::lock_guard lock(mutex_);
    busy_ = false;
    progress_ = clock_.now();
  }
}

void Recorder::write(std::vector<Item> items) {
  for (Item& item : items)
    apply(item);
  commit();
}

void Recorder::apply(Item& item) {
  if (auto* begin = std::get_if<Begin>(&item)) {
    commit();
    writer_ = std::move(begin->writer);
    failed_ = false;
  } else if (auto* waiting = std::get_if<Waiting>(&item)) {
    documents_.push_back(std::move(*waiting));
  } else if (auto* finish = std::get_if<Finish>(&item)) {
    commit();
    if (writer_) keep(writer_->finish(finish->status, finish->utc));
    writer_.reset();
    failed_ = false;
  } else if (writer_) {
    dirty_ = true;
    if (auto* run = std::get_if<record::RunRow>(&item)) keep(writer_->add_run(*run));
    if (auto* cycle = std::get_if<record::CycleRow>(&item)) keep(writer_->add_cycle(*cycle));
    if (auto* samples = std::get_if<Samples>(&item)) {
      keep(writer_->add_samples(samples->run, samples->rows));
    }
  }
}

void Recorder::keep(const Result<void>& outcome) {
  if (!outcome) fail(outcome.error());
}

std::vector<PublishedLine> Recorder::serialise() const {
  std::vector<PublishedLine> lines;
  std::uint64_t seq = seq_;
  for (const Waiting& waiting : documents_) {
    ++seq;
    lines.push_back(
        {seq, protocol::type_name(waiting.document),
         protocol::to_json_line(waiting.document, {seq, waiting.utc, waiting.mono_ns})});
  }
  return lines;
}

// The flush is here.
void Recorder::store(const std::vector<PublishedLine>& lines) {
  const Nanoseconds before = clock_.now();
  for (const PublishedLine& line : lines) {
    if (writer_) keep(writer_->add_document(line.seq, line.text));
  }
  if (writer_) keep(writer_->commit());
  const std::lock_guard lock(mutex_);
  flush_max_ = std::max(flush_max_, clock_.now() - before);
}

// Serialises what waits, writes it and flushes; then, and only then, lets it go.
void Recorder::commit() {
  if (documents_.empty() && !dirty_) return;
  auto lines = serialise();
  if (writer_) store(lines);
  dirty_ = false;
  if (failed_) {
    std::erase_if(documents_, [](const Waiting& w) { return must_be_kept(w.document); });
    if (alarm_) documents_.push_back(std::move(*alarm_));
    alarm_.reset();
    lines = serialise();
  }
  documents_.clear();
  if (lines.empty()) return;
  seq_ = lines.back().seq;
  {
    const std::lock_guard lock(mutex_);
    std::ranges::move(lines, std::back_inserter(published_));
  }
  wake_();
}

// What was committed is kept: closing the file rolls the rest back.
void Recorder::fail(const Error& error) {
  spdlog::error("Recording has failed. {}", error.what);
  writer_.reset();
  failed_ = true;
  alarm_ = stamped(
      protocol::AlarmDocument{"error", "recording_failed", error.what, "ramp_down", {}, {}, {}});
  const std::lock_guard lock(mutex_);
  trouble_ = error;
}

}  // namespace shaker::daemon
