#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/data/formats.hpp"
#include "cli/data/out_file.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::ordered_json;

// The times continue through the run at its mean frequency, so that an estimate can use the
// file.
void write_cycles(const ExportRun& run, OutFile& out) {
  out.write("t,excitation,displacement,cycle,accepted,frequency_hz,amplitude\n");
  const double frequency = run.mean_frequency();
  for (const record::CycleRow& cycle : run.cycles) {
    const std::size_t n = cycle.displacement.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double tau = static_cast<double>(i) / static_cast<double>(n);
      // An excitation that was not measured is a cosine, by the definition of tau.
      const std::string x =
          i < cycle.excitation.size() ? fmt::format("{}", cycle.excitation[i]) : "";
      out.write("{},{},{},{},{},{},{}\n", (static_cast<double>(cycle.index) + tau) / frequency, x,
                cycle.displacement[i], cycle.index, cycle.accepted ? 1 : 0, cycle.frequency_hz,
                cycle.amplitude);
    }
  }
}

// Writes the samples of all channels in the order of time. Returns their number.
std::size_t write_samples(const ExportRun& run, OutFile& out) {
  constexpr const char* kQuality[] = {"good", "suspect", "bad"};
  out.write("t,channel,value,quality,unit\n");
  std::vector<std::size_t> next(run.channels.size(), 0);
  std::size_t count = 0;
  for (;; ++count) {
    const ExportChannel* first = nullptr;
    std::size_t which = 0;
    for (std::size_t c = 0; c < run.channels.size(); ++c) {
      const ExportChannel& channel = run.channels[c];
      if (next[c] < channel.t.size() && (!first || channel.t[next[c]] < first->t[next[which]])) {
        first = &channel;
        which = c;
      }
    }
    if (!first) return count;
    const std::size_t i = next[which]++;
    const auto quality = first->quality[i];
    out.write("{:.9f},{},{},{},{}\n", first->t[i], first->name, first->value[i],
              quality < 3 ? kQuality[quality] : "unknown", first->unit);
  }
}

Json parsed(const std::string& text) {
  Json found = Json::parse(text, nullptr, false);
  return found.is_discarded() ? Json(text) : found;
}

// The facts that the columns do not contain: units, rig, dates, specification and model.
Json sidecar(const ExportData& data, const std::vector<Written>& files, bool samples) {
  const record::CampaignRow& c = data.campaign;
  Json units = samples ? Json{{"t", "s"}, {"value", "see the column unit"}}
                       : Json{{"t", "s"},
                              {"excitation", "m/s^2"},
                              {"displacement", "m"},
                              {"frequency_hz", "Hz"},
                              {"amplitude", "m/s^2"}};
  Json runs = Json::array();
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    const record::RunRow& row = data.runs[i].row;
    runs.push_back({{"name", row.name},
                    {"file", files[i].file.filename().string()},
                    {"frequency_hz", row.frequency_hz},
                    {"amplitude", row.amplitude},
                    {"cycles_wanted", row.cycles_wanted}});
  }
  return {{"campaign", c.name},
          {"rig", c.rig},
          {"started_utc", c.started_utc},
          {"finished_utc", c.finished_utc},
          {"status", c.status},
          {"units", units},
          {"runs", runs},
          {"specification", parsed(c.spec_json)},
          {"model", parsed(c.model_json)}};
}

}  // namespace

Result<std::vector<Written>> write_csv(const ExportData& data, bool samples,
                                       const std::filesystem::path& folder) {
  std::vector<Written> files;
  for (const ExportRun& run : data.runs) {
    const char* what = samples ? "samples" : "cycles";
    Written file{run.row.name,
                 folder / (export_name(data, fmt::format("{}_{}", run.row.name, what)) + ".csv"),
                 run.cycles.size()};
    OutFile out(file.file);
    if (samples)
      file.count = write_samples(run, out);
    else
      write_cycles(run, out);
    if (auto done = out.finish(); !done) return done.error();
    files.push_back(std::move(file));
  }
  OutFile beside(folder / (export_name(data, "export") + ".json"));
  beside.write(
      "{}\n",
      sidecar(data, files, samples).dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  if (auto done = beside.finish(); !done) return done.error();
  return files;
}

}  // namespace shaker::cli
