// A campaign database as CSV, one file a run: cycles as they were estimated from, or raw samples.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {
namespace {

// A file that is there under its name only when it is whole.
class OutFile {
 public:
  explicit OutFile(std::filesystem::path name)
      : name_(std::move(name)),
        part_(name_.string() + ".part"),
        file_(std::fopen(part_.c_str(), "wbe"), &std::fclose) {}
  ~OutFile() {
    if (file_) {
      file_.reset();
      std::remove(part_.c_str());
    }
  }
  OutFile(const OutFile&) = delete;
  OutFile& operator=(const OutFile&) = delete;

  template <class... Args>
  void write(fmt::format_string<Args...> format, Args&&... args) {
    if (file_) fmt::print(file_.get(), format, std::forward<Args>(args)...);
  }
  Result<void> finish() {
    if (!file_) return trouble();
    const bool bad = std::fflush(file_.get()) != 0 || std::ferror(file_.get()) != 0;
    if (bad) return trouble();
    if (std::fclose(file_.release()) != 0) return trouble();
    if (std::rename(part_.c_str(), name_.c_str()) != 0) return trouble();
    return {};
  }

 private:
  Error trouble() const {
    return {ErrorKind::io,
            fmt::format("{}: cannot be written: {}", name_.string(), std::strerror(errno))};
  }
  std::filesystem::path name_;
  std::string part_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

std::string file_name(const std::string& campaign, const record::RunRow& run, const char* what) {
  std::string name = fmt::format("{}_{}_{}.csv", campaign, run.name, what);
  for (char& c : name) {
    if (c == '/' || static_cast<unsigned char>(c) <= 0x20) c = '_';
  }
  if (name.starts_with('.')) name[0] = '_';
  return name;
}

// t runs on through the run at its mean frequency, so that the file can be estimated from.
Result<void> write_cycles(const std::vector<record::CycleRow>& cycles, OutFile& out) {
  out.write("t,excitation,displacement,cycle,accepted,frequency_hz,amplitude\n");
  double frequency = 0.0;
  for (const auto& cycle : cycles) {
    frequency += cycle.frequency_hz / static_cast<double>(cycles.size());
  }
  for (const record::CycleRow& cycle : cycles) {
    const std::size_t n = cycle.displacement.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double tau = static_cast<double>(i) / static_cast<double>(n);
      // Where the excitation was not measured it is a cosine by definition of tau.
      const std::string x =
          i < cycle.excitation.size() ? fmt::format("{}", cycle.excitation[i]) : "";
      out.write("{},{},{},{},{},{},{}\n", (static_cast<double>(cycle.index) + tau) / frequency, x,
                cycle.displacement[i], cycle.index, cycle.accepted ? 1 : 0, cycle.frequency_hz,
                cycle.amplitude);
    }
  }
  return out.finish();
}

Result<void> write_samples(const std::vector<record::SampleRow>& samples,
                           const protocol::ChannelLabels& auxiliary, OutFile& out) {
  out.write("t,channel,value,quality,unit\n");
  std::vector<protocol::ChannelLabel> labels;
  for (int i = 0; i < protocol::kChannelCount; ++i)
    labels.push_back(protocol::label(static_cast<protocol::Channel>(i), auxiliary));
  constexpr const char* kQuality[] = {"good", "suspect", "bad"};
  for (const record::SampleRow& sample : samples) {
    const auto& label = labels[static_cast<std::size_t>(sample.channel)];
    out.write("{:.9f},{},{},{},{}\n",
              1e-9 * static_cast<double>(sample.t_ns - samples.front().t_ns), label.name,
              sample.value, sample.quality < 3 ? kQuality[sample.quality] : "unknown", label.unit);
  }
  return out.finish();
}

Result<std::size_t> write_run(const record::CampaignReader& reader,
                              const protocol::ChannelLabels& auxiliary, const record::RunRow& run,
                              const ExportOptions& options, const std::filesystem::path& file) {
  OutFile out(file);
  if (options.samples) {
    const auto samples = reader.samples(run.index);
    if (!samples) return samples.error();
    const auto written = write_samples(*samples, auxiliary, out);
    return written ? Result<std::size_t>(samples->size()) : written.error();
  }
  auto cycles = reader.cycles(run.index);
  if (!cycles) return cycles.error();
  if (!options.all) std::erase_if(*cycles, [](const record::CycleRow& c) { return !c.accepted; });
  const auto written = write_cycles(*cycles, out);
  return written ? Result<std::size_t>(cycles->size()) : written.error();
}

}  // namespace

int export_runs(const Common& common, const ExportOptions& options) {
  const auto reader = record::CampaignReader::open(options.database);
  if (!reader) return fail(common, kBadInput, reader.error().what);
  const auto campaign = reader->campaign();
  if (!campaign) return fail(common, kBadInput, campaign.error().what);
  const auto runs = reader->runs();
  if (!runs) return fail(common, kBadInput, runs.error().what);
  std::error_code code;
  std::filesystem::create_directories(options.directory, code);
  const char* what = options.samples ? "samples" : "cycles";
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (const record::RunRow& run : *runs) {
    const auto file = options.directory / file_name(campaign->name, run, what);
    const auto count = write_run(*reader, campaign->auxiliary, run, options, file);
    if (!count) return fail(common, kBadInput, count.error().what);
    files.push_back({{"run", run.name}, {"file", file.string()}, {what, *count}});
    if (!common.json) fmt::print("{}: {} {}\n", file.string(), *count, what);
  }
  if (common.json) {
    const nlohmann::ordered_json body = {{"campaign", campaign->name}, {"files", files}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  if (runs->empty()) return fail(common, kNegative, "the campaign has no run yet");
  return kOk;
}

}  // namespace shaker::cli
