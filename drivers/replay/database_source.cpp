#include "drivers/replay/database_source.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "record/campaign_database.hpp"

namespace shaker::drivers::replay {
namespace {

Quality quality_from(std::uint8_t stored) {
  return stored <= static_cast<std::uint8_t>(Quality::bad) ? static_cast<Quality>(stored)
                                                           : Quality::bad;
}

class DatabaseSource final : public Source {
 public:
  explicit DatabaseSource(std::vector<Sample> samples) : samples_(std::move(samples)) {
    for (const Sample& sample : samples_) {
      if (std::ranges::find(channels_, sample.channel) == channels_.end()) {
        channels_.push_back(sample.channel);
      }
    }
  }

  std::vector<protocol::Channel> channels() const override { return channels_; }
  std::size_t most_samples() const override { return 1; }
  const SensorHealth& health() const override { return health_; }

  Result<void> rewind() override {
    at_ = 0;
    health_ = {};
    health_.link_up = true;
    return {};
  }
  std::size_t next(std::span<Sample> out) override {
    if (at_ == samples_.size()) return 0;
    out[0] = samples_[at_++];
    ++health_.samples;
    return 1;
  }

 private:
  std::vector<Sample> samples_;
  std::vector<protocol::Channel> channels_;
  std::size_t at_ = 0;
  SensorHealth health_;
};

}  // namespace

Result<std::unique_ptr<Source>> open_campaign(const std::filesystem::path& file) {
  auto reader = record::CampaignReader::open(file);
  if (!reader) return reader.error();
  const auto runs = reader->runs();
  if (!runs) return runs.error();
  std::vector<Sample> samples;
  for (const record::RunRow& run : *runs) {
    const auto rows = reader->samples(run.index);
    if (!rows) return rows.error();
    samples.reserve(samples.size() + rows->size());
    for (const record::SampleRow& row : *rows) {
      samples.push_back({Nanoseconds(row.t_ns), row.value, row.channel, quality_from(row.quality)});
    }
  }
  if (samples.empty()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{} holds no samples to replay; choose a campaign that has measured",
                             file.string())};
  }
  return std::unique_ptr<Source>(std::make_unique<DatabaseSource>(std::move(samples)));
}

}  // namespace shaker::drivers::replay
