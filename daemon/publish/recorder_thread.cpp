// The recorder's thread: writes items, flushes, and releases the documents.
#include <algorithm>
#include <exception>
#include <iterator>

#include <spdlog/spdlog.h>

#include "daemon/publish/recorder.hpp"
#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kSamplesWait = 500ms;  // longest wait before raw samples are committed
constexpr auto kLook = 1s;            // between two checks of the free space

}  // namespace

void Recorder::work(const std::stop_token& stop) {
  name_this_thread("recorder");
  while (true) {
    std::size_t count = 0;
    {
      std::unique_lock lock(mutex_);
      ready_.wait_for(lock, stop, kSamplesWait, [this] { return urgent_; });
      if (stop.stop_requested() && queue_.empty()) break;
      count = queue_.size();
      waiting_bytes_ = 0;
      urgent_ = false;
      busy_ = true;
      advance();
    }
    // No exception may leave a thread, for example for lack of memory.
    try {
      if (count > 0) write(count);
      look_at_the_disk();
    } catch (const std::exception& trouble) {
      fail(Error{ErrorKind::exhausted, trouble.what()});
      const std::lock_guard lock(mutex_);
      documents_.clear();
      in_flight_.clear();
    }
    const std::lock_guard lock(mutex_);
    busy_ = false;
    advance();
  }
}

void Recorder::advance() {
  progress_ = clock_.now().count();
}

// A mount that hangs shows here as well as in a write.
void Recorder::look_at_the_disk() {
  if (clock_.now() < next_look_) return;
  next_look_ = clock_.now() + kLook;
  std::error_code trouble;
  const auto space = std::filesystem::space(options_.directory, trouble);
  if (!trouble) disk_free_ = space.available;
}

// Writes the oldest `count` items one by one. The rest can still be published without the disk.
void Recorder::write(std::size_t count) {
  for (; count > 0; --count) {
    std::optional<Item> item;
    {
      const std::lock_guard lock(mutex_);
      if (queue_.empty()) break;
      item = std::move(queue_.front());
      queue_.pop_front();
    }
    apply(*item);
  }
  commit();
}

void Recorder::apply(Item& item) {
  if (auto* begin = std::get_if<Begin>(&item)) {
    commit();
    writer_ = std::move(begin->writer);
    failed_ = false;
  } else if (auto* waiting = std::get_if<Waiting>(&item)) {
    const std::lock_guard lock(mutex_);
    documents_.push_back(std::move(*waiting));
  } else if (auto* finish = std::get_if<Finish>(&item)) {
    commit();
    if (writer_) keep(writer_->add_fact({"person", "ended because", finish->reason}, finish->utc));
    if (writer_) keep(writer_->finish(finish->status, finish->utc));
    writer_.reset();
    failed_ = false;
  } else if (writer_) {
    dirty_ = true;
    if (auto* run = std::get_if<record::RunRow>(&item)) keep(writer_->add_run(*run));
    if (auto* cycle = std::get_if<record::CycleRow>(&item)) {
      keep(writer_->add_cycle(*cycle));
      show(*cycle);
    }
    if (auto* samples = std::get_if<Samples>(&item)) {
      keep(writer_->add_samples(samples->run, samples->rows));
    }
  }
}

void Recorder::keep(const Result<void>& outcome) {
  advance();
  if (!outcome) fail(outcome.error());
}

// The estimator's thread shows the accepted cycles, with the model's response.
void Recorder::show(record::CycleRow& cycle) {
  if (options_.waves == nullptr || cycle.accepted) return;
  options_.waves->put({.run_index = cycle.run,
                       .cycle = cycle.index,
                       .accepted = false,
                       .frequency_hz = cycle.frequency_hz,
                       .stroke_m = std::move(cycle.displacement),
                       .excitation_m_s2 = std::move(cycle.excitation),
                       .response_m = {},
                       .missing_force_m_s2 = {}});
}

// Serialises documents with the next sequence numbers. Call with the lock held.
std::vector<PublishedLine> Recorder::numbered(const std::vector<Waiting>& documents) {
  std::vector<PublishedLine> lines;
  for (const Waiting& waiting : documents) {
    ++seq_;
    lines.push_back(
        {seq_, protocol::type_name(waiting.document),
         protocol::to_json_line(waiting.document, {seq_, waiting.utc, waiting.mono_ns})});
  }
  return lines;
}

// Writes the lines and flushes.
void Recorder::store(const std::vector<PublishedLine>& lines) {
  const Nanoseconds before = clock_.now();
  for (const PublishedLine& line : lines) {
    if (writer_) keep(writer_->add_document(line.seq, line.text));
  }
  if (writer_) keep(writer_->commit());
  if (writer_) keep(writer_->still_there());  // a document that is in no file is not acknowledged
  const std::lock_guard lock(mutex_);
  flush_max_ = std::max(flush_max_, clock_.now() - before);
}

// Numbers the waiting documents, writes and flushes them, and only then releases them. If the
// disk returns after it was given up, they are not released, because let_pass() already has
// published them or others.
void Recorder::commit() {
  std::vector<Waiting> documents;
  std::vector<PublishedLine> lines;
  {
    const std::lock_guard lock(mutex_);
    documents.swap(documents_);
    lines = numbered(documents);
    if (writer_) in_flight_ = lines;
  }
  if (lines.empty() && !dirty_) return;
  if (writer_) store(lines);
  dirty_ = false;
  if (stalled_ && writer_)
    fail(Error{ErrorKind::timeout, "The disk was given up while it did not answer."});
  const std::lock_guard lock(mutex_);
  const bool passed = stalled_ && in_flight_.empty();
  in_flight_.clear();
  if (passed || lines.empty()) return;
  if (failed_) {
    std::erase_if(documents, [](const Waiting& w) { return must_be_kept(w.document); });
    if (seq_ == lines.back().seq) seq_ -= lines.size();
    lines = numbered(documents);
  }
  std::ranges::move(lines, std::back_inserter(published_));
  wake_();
}

// Committed data are kept: closing the file rolls the rest back.
void Recorder::fail(const Error& error) {
  spdlog::error("Recording has failed. {}", error.what);
  writer_.reset();
  failed_ = true;
  const std::lock_guard lock(mutex_);
  if (!trouble_) trouble_ = error;
}

}  // namespace shaker::daemon
