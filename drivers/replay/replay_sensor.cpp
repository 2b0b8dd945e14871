#include "drivers/replay/replay_sensor.hpp"

#include <algorithm>
#include <fstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "drivers/replay/candump_source.hpp"
#include "drivers/replay/database_source.hpp"
#include "drivers/replay/register_source.hpp"

namespace shaker::drivers::replay {
namespace {

class ReplaySensor final : public Sensor {
 public:
  ReplaySensor(std::string file, double speed, std::unique_ptr<Source> source, Clock& clock)
      : file_(std::move(file)), speed_(speed), source_(std::move(source)), clock_(clock) {
    pending_.resize(source_->most_samples());
  }

  std::string description() const override {
    return fmt::format("replay of {}{}", file_,
                       speed_ > 0.0 ? fmt::format(" at {} times its speed", speed_) : "");
  }
  std::vector<protocol::Channel> channels() const override { return source_->channels(); }
  StampSource stamp_source() const override { return StampSource::recorded; }
  SensorHealth health() const override { return source_->health(); }
  bool finished() const override { return finished_; }

  Result<void> connect() override;
  Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) override;

 private:
  void fetch();
  Nanoseconds due() const;

  std::string file_;
  double speed_;
  std::unique_ptr<Source> source_;
  Clock& clock_;
  std::vector<Sample> pending_;  // samples of the next time, with our stamps
  std::size_t pending_count_ = 0;
  bool connected_ = false, first_ = true, finished_ = false;
  Nanoseconds shift_{};  // from recorded to our time
  Nanoseconds start_{}, newest_{};
};

Result<void> ReplaySensor::connect() {
  if (auto done = source_->rewind(); !done) return done;
  connected_ = first_ = true;
  finished_ = false;
  start_ = newest_ = clock_.now();
  fetch();
  return {};
}

void ReplaySensor::fetch() {
  pending_count_ = source_->next(pending_);
  finished_ = pending_count_ == 0;
  if (finished_) return;
  if (std::exchange(first_, false)) shift_ = start_ - pending_[0].t;
  for (Sample& sample : std::span(pending_).first(pending_count_)) {
    // If the clock of the recording was stepped back, the time stands still until it has caught
    // up.
    newest_ = std::max(newest_, sample.t + shift_);
    sample.t = newest_;
  }
}

Nanoseconds ReplaySensor::due() const {
  if (speed_ <= 0.0) return Nanoseconds::min();
  return start_ + from_seconds(seconds(pending_[0].t - start_) / speed_);
}

Result<std::size_t> ReplaySensor::read(std::span<Sample> out, Nanoseconds timeout) {
  if (!connected_) {
    return Error{ErrorKind::unavailable, fmt::format("{} is not open: connect() first", file_)};
  }
  if (out.size() < pending_.size()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: a moment holds {} samples, there is room for {}", file_,
                             pending_.size(), out.size())};
  }
  const auto deadline = clock_.now() + timeout;
  std::size_t count = 0;
  while (!finished_ && out.size() - count >= pending_count_) {
    if (due() > clock_.now()) {
      if (count > 0) break;
      clock_.sleep_until(std::min(due(), deadline));
      if (due() > clock_.now()) break;
    }
    std::copy_n(pending_.begin(), pending_count_, out.begin() + static_cast<std::ptrdiff_t>(count));
    count += pending_count_;
    fetch();
  }
  return count;
}

bool is_database(const std::filesystem::path& file) {
  constexpr std::string_view magic{"SQLite format 3\0", 16};
  char head[magic.size()] = {};
  std::ifstream(file, std::ios::binary).read(head, sizeof head);
  return std::string_view(head, sizeof head) == magic;
}

}  // namespace

Result<std::unique_ptr<Sensor>> make_replay_sensor(const config::ReplaySensor& config,
                                                   const std::filesystem::path& directory,
                                                   Clock& clock) {
  const auto file = directory / config.file;
  std::error_code unreadable;
  if (!std::filesystem::is_regular_file(file, unreadable)) {
    return Error{ErrorKind::invalid,
                 fmt::format("there is no recording {}; give a campaign database or a "
                             "candump -l log, relative to the rig file",
                             file.string())};
  }
  if (!(config.speed >= 0.0)) {
    return Error{ErrorKind::invalid,
                 fmt::format("replay: speed is {}, allowed is 0 (as fast as it is read) or more",
                             config.speed)};
  }
  auto source = is_database(file)           ? open_campaign(file)
                : !config.registers.empty() ? open_register_log(config, directory)
                                            : open_candump(config, directory);
  if (!source) return source.error();
  return std::unique_ptr<Sensor>(
      std::make_unique<ReplaySensor>(file.string(), config.speed, std::move(*source), clock));
}

}  // namespace shaker::drivers::replay
