#include "cli/data/export_data.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "cli/campaign_place.hpp"

namespace shaker::cli {
namespace {

std::vector<ExportChannel> channels_of(const std::vector<record::SampleRow>& samples,
                                       const protocol::ChannelLabels& labels) {
  std::vector<ExportChannel> all(protocol::kChannelCount);
  for (const record::SampleRow& sample : samples) {
    ExportChannel& channel = all.at(static_cast<std::size_t>(sample.channel));
    channel.t.push_back(1e-9 * static_cast<double>(sample.t_ns - samples.front().t_ns));
    channel.value.push_back(sample.value);
    channel.quality.push_back(sample.quality);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto label = protocol::label(static_cast<protocol::Channel>(i), labels);
    all[i].name = label.name;
    all[i].unit = label.unit;
  }
  std::erase_if(all, [](const ExportChannel& channel) { return channel.t.empty(); });
  return all;
}

}  // namespace

double ExportRun::mean_frequency() const {
  if (cycles.empty()) return row.frequency_hz;
  return std::accumulate(cycles.begin(), cycles.end(), 0.0,
                         [](double sum, const auto& cycle) { return sum + cycle.frequency_hz; }) /
         static_cast<double>(cycles.size());
}

Result<ExportData> read_export(const std::filesystem::path& database, const ExportWanted& wanted) {
  if (auto good = expect_file(database); !good) return good.error();
  const auto reader = record::CampaignReader::open(database);
  if (!reader) return reader.error();
  const auto campaign = reader->campaign();
  if (!campaign) return campaign.error();
  const auto runs = reader->runs();
  if (!runs) return runs.error();
  ExportData data{*campaign, {}};
  for (const record::RunRow& row : *runs) {
    ExportRun run{row, {}, {}};
    auto cycles = reader->cycles(row.index);
    if (!cycles) return cycles.error();
    run.cycles = std::move(*cycles);
    if (!wanted.left_out)
      std::erase_if(run.cycles, [](const record::CycleRow& c) { return !c.accepted; });
    if (wanted.samples) {
      const auto samples = reader->samples(row.index);
      if (!samples) return samples.error();
      run.channels = channels_of(*samples, campaign->auxiliary);
    }
    data.runs.push_back(std::move(run));
  }
  return data;
}

std::string plain_file_name(std::string name) {
  for (char& c : name) {
    if (c == '/' || static_cast<unsigned char>(c) <= 0x20) c = '_';
  }
  if (name.starts_with('.')) name[0] = '_';
  for (auto at = name.find(".."); at != name.npos; at = name.find("..", at))
    name[at] = '_';
  return name;
}

std::string export_name(const ExportData& data, const std::string& rest) {
  return plain_file_name(fmt::format("{}_{}", data.campaign.name, rest));
}

}  // namespace shaker::cli
