// The documents for people who look on.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "protocol/document_filler.hpp"

namespace shaker::protocol {
namespace {

constexpr std::size_t kMaxCurve = 4096, kMaxBins = 64, kMaxPlannedRuns = 256;

// Seven digits: enough to look at, and a third of the bytes.
void put_curve(Filler& out, const char* key, const std::vector<double>& values, std::size_t most) {
  if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); }))
    return out.omit(key, "a value is not finite");
  OrderedJson list = OrderedJson::array();
  const auto count = out.bounded(key, values.size(), most);
  for (std::size_t i = 0; i < count; ++i)
    list.push_back(std::strtod(fmt::format("{:.7g}", values[i]).c_str(), nullptr));
  out.put(key, list);
}

void fill_plan(Filler& out, const PlannedCampaign& d) {
  OrderedJson runs = OrderedJson::array();
  for (const PlannedRun& run : d.runs) {
    if (runs.size() == kMaxPlannedRuns) break;
    runs.push_back({{"run", clip(run.run, kMaxName)},
                    {"frequency_hz", run.frequency_hz},
                    {"amplitude", run.amplitude},
                    {"cycles_wanted", run.cycles_wanted}});
  }
  OrderedJson plan = {{"campaign", clip(d.campaign, kMaxName)},
                      {"settle_tolerance", d.settle_tolerance},
                      {"runs", std::move(runs)}};
  for (const auto& [key, text] : d.specimen)
    plan["specimen"][key] = clip(text, kMaxText);
  out.put("plan", plan);
  if (d.runs.size() > kMaxPlannedRuns)
    out.omit(fmt::format("plan/runs/{}", kMaxPlannedRuns),
             fmt::format("{} more", d.runs.size() - kMaxPlannedRuns));
}

}  // namespace

void fill(Filler& out, const WaveDocument& d) {
  out.put("run_index", d.run_index).put("cycle", d.cycle).put("accepted", d.accepted);
  out.number("frequency_hz", d.frequency_hz);
  put_curve(out, "stroke_m", d.stroke_m, kMaxCurve);
  if (!d.excitation_m_s2.empty()) put_curve(out, "excitation_m_s2", d.excitation_m_s2, kMaxCurve);
  if (!d.response_m.empty()) put_curve(out, "response_m", d.response_m, kMaxCurve);
  if (!d.missing_force_m_s2.empty())
    put_curve(out, "missing_force_m_s2", d.missing_force_m_s2, kMaxCurve);
}

void fill(Filler& out, const ScopeDocument& d) {
  out.number("bin_s", d.bin_s);
  out.object()["channels"] = OrderedJson::array();
  const auto count = out.bounded("channels", d.channels.size(), kMaxChannels);
  for (std::size_t i = 0; i < count; ++i) {
    const ScopeChannel& c = d.channels[i];
    Filler entry = out.inner("channels", i);
    const auto bins = entry.bounded("bin", c.bin.size(), kMaxBins);
    entry.name("channel", c.channel);
    entry.put("bin", std::vector<std::int64_t>(c.bin.begin(),
                                               c.bin.begin() + static_cast<std::ptrdiff_t>(bins)));
    put_curve(entry, "min", c.smallest, kMaxBins);
    put_curve(entry, "max", c.largest, kMaxBins);
  }
}

void fill(Filler& out, const RigDocument& d) {
  out.name("rig", d.rig).number("stroke_min_m", d.stroke_min_m);
  out.number("stroke_max_m", d.stroke_max_m).number("stroke_rate_max_m_s", d.stroke_rate_max_m_s);
  out.number("excitation_max_m_s2", d.excitation_max_m_s2);
  out.number("frequency_min_hz", d.frequency_min_hz).number("frequency_max_hz", d.frequency_max_hz);
  out.number("stale_s", d.stale_s).number("ramp_s", d.ramp_s);
  out.number("client_lease_s", d.client_lease_s).put("unprotected", d.unprotected);
  for (const char* list : {"detectors", "channels"})
    out.object()[list] = OrderedJson::array();
  const auto detectors = out.bounded("detectors", d.detectors.size(), kMaxChannels);
  for (std::size_t i = 0; i < detectors; ++i) {
    const RigDetector& one = d.detectors[i];
    out.inner("detectors", i).name("detector", one.detector).name("action", one.action);
  }
  const auto channels = out.bounded("channels", d.channels.size(), kMaxChannels);
  for (std::size_t i = 0; i < channels; ++i) {
    const RigChannel& one = d.channels[i];
    out.inner("channels", i)
        .name("channel", one.channel)
        .name("name", one.name)
        .name("unit", one.unit);
  }
  out.name("in_control", d.in_control);
  if (d.plan) fill_plan(out, *d.plan);
}

}  // namespace shaker::protocol
