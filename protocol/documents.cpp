// Every string is clipped and every list is limited, so that a line stays below 1 MiB whatever
// the caller passes (an escaped control character takes six bytes). Cut values are listed under
// "omitted", as are numbers that are not finite.
#include "protocol/documents.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/document_filler.hpp"

namespace shaker::protocol {
namespace {

constexpr std::size_t kMaxDiagnosis = 900 * 1024;  // bytes
constexpr std::size_t kMaxWarnings = 32, kMaxParameters = 256, kMaxCovariance = 64;

void fill(Filler& out, const VersionDocument& d) {
  out.name("program", d.program).name("version", d.version).put("protocol", d.protocol);
  out.name("rig", d.rig);
  if (!d.limits) return;
  OrderedJson& limits = out.object()["limits"];
  limits["stroke_min_m"] = d.limits->stroke_min_m;
  limits["stroke_max_m"] = d.limits->stroke_max_m;
  limits["stroke_rate_max_m_s"] = d.limits->stroke_rate_max_m_s;
  limits["excitation_max_m_s2"] = d.limits->excitation_max_m_s2;
}

void fill(Filler& out, const StateDocument& d) {
  out.name("state", d.state).text("reason", d.reason).name("campaign", d.campaign);
  out.name("run", d.run).put("run_index", d.run_index).put("run_count", d.run_count);
  out.number("frequency_hz", d.frequency_hz).number("amplitude", d.amplitude);
  out.number("progress", d.progress).number("eta_s", d.eta_s).put("controlled", d.controlled);
  if (d.unprotected) out.put("unprotected", true);
}

void fill(Filler& out, const RunStartDocument& d) {
  out.name("campaign", d.campaign).name("run", d.run);
  out.put("run_index", d.run_index).put("run_count", d.run_count);
  out.number("frequency_hz", d.frequency_hz).number("amplitude", d.amplitude);
  out.put("cycles_wanted", d.cycles_wanted);
}

void fill(Filler& out, const CycleDocument& d) {
  out.name("campaign", d.campaign).name("run", d.run).put("cycle", d.cycle);
  out.put("accepted", d.accepted);
  if (!d.why.empty()) out.text("why", d.why);
  out.number("frequency_hz", d.frequency_hz).number("amplitude", d.amplitude);
  out.number("stroke_min_m", d.stroke_min_m).number("stroke_max_m", d.stroke_max_m);
  out.number("change", d.change).put("gaps", d.gaps).put("samples", d.samples);
  out.number("jitter_fraction", d.jitter_fraction).put("subharmonic", d.subharmonic);
  out.number("ordered", d.ordered).number("corrected_to", d.corrected_to);
  out.number("stroke_rate_m_s", d.stroke_rate_m_s);
}

void fill(Filler& out, const ParameterEntry& p) {
  out.name("name", p.name).name("effect", p.effect).name("unit", p.unit);
  out.number("value", p.value).number("standard_error", p.standard_error);
  if (p.bias) out.number("bias", *p.bias);
  if (std::isfinite(p.lower) && std::isfinite(p.upper)) {
    out.put("interval", OrderedJson::array({p.lower, p.upper}));
  } else {
    out.omit("interval", "a bound is not finite");
  }
  out.put("fixed", p.fixed).put("at_bound", p.at_bound).put("determined", p.determined);
}

void fill_correlation(Filler& out, const std::vector<double>& covariance, std::size_t n) {
  OrderedJson matrix = OrderedJson::array();
  for (std::size_t i = 0; i < n; ++i) {
    if (!(covariance[i * n + i] > 0.0))
      return out.omit("correlation", "a variance is not positive");
    matrix.push_back(OrderedJson::array());
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      const double scale = std::sqrt(covariance[i * n + i]) * std::sqrt(covariance[k * n + k]);
      matrix[i].push_back(i == k ? 1.0 : std::clamp(covariance[i * n + k] / scale, -1.0, 1.0));
    }
  }
  out.put("correlation", matrix);
}

void fill_covariance(Filler& out, const EstimateDocument& d) {
  const std::size_t n = d.covariance_order.size();
  if (n > kMaxCovariance) {
    return out.omit("covariance", fmt::format("more than {} parameters", kMaxCovariance));
  }
  if (d.covariance.size() != n * n) {
    return out.omit("covariance",
                    fmt::format("{} numbers for {} parameters", d.covariance.size(), n));
  }
  for (double value : d.covariance) {
    if (!std::isfinite(value)) return out.omit("covariance", "an element is not finite");
  }
  OrderedJson order = OrderedJson::array(), matrix = OrderedJson::array();
  for (std::size_t i = 0; i < n; ++i) {
    order.push_back(clip(d.covariance_order[i], kMaxName));
    matrix.push_back(OrderedJson::array());
    for (std::size_t k = 0; k < n; ++k)
      matrix.back().push_back(d.covariance[i * n + k]);
  }
  out.put("covariance_order", order).put("covariance", matrix);
  fill_correlation(out, d.covariance, n);
}

void fill(Filler& out, const EstimateDocument& d) {
  out.name("campaign", d.campaign).name("run", d.run).put("cycle", d.cycle);
  out.name("model", d.model);
  out.object()["parameters"] = OrderedJson::array();
  const auto count = out.bounded("parameters", d.parameters.size(), kMaxParameters);
  for (std::size_t i = 0; i < count; ++i) {
    Filler entry = out.inner("parameters", i);
    fill(entry, d.parameters[i]);
  }
  fill_covariance(out, d);
  out.number("noise_standard_deviation", d.noise_standard_deviation);
  out.number("sum_of_squares", d.sum_of_squares).number("condition", d.condition);
  out.put("observations", d.observations).put("degrees_of_freedom", d.degrees_of_freedom);
  out.put("cycles_used", d.cycles_used).put("runs_used", d.runs_used);
  out.put("iterations", d.iterations).put("cycles_skipped", d.cycles_skipped);
  out.name("clock", d.clock).number("latency_s", d.latency_s);
  out.put("converged", d.converged).put("usable", d.usable);
  out.put("intervals_hold", d.intervals_hold);
  out.number("gap", d.gap).number("noise_floor", d.noise_floor);
  OrderedJson warnings = OrderedJson::array();
  const auto warned = out.bounded("warnings", d.warnings.size(), kMaxWarnings);
  for (std::size_t i = 0; i < warned; ++i)
    warnings.push_back(clip(d.warnings[i], kMaxText));
  out.put("warnings", warnings);
}

void fill(Filler& out, const AlarmDocument& d) {
  out.name("severity", d.severity).name("code", d.code).text("text", d.text);
  out.name("cause", d.cause).name("action", d.action).name("channel", d.channel);
  out.number("value", d.value).number("limit", d.limit);
  out.name("parameter", d.parameter).name("run", d.run);
  out.put("cycle", d.cycle).number("standard_error", d.standard_error).put("alone", d.alone);
  if (d.alternatives.empty()) return;
  OrderedJson names = OrderedJson::array();
  const auto count = out.bounded("alternatives", d.alternatives.size(), kMaxWarnings);
  for (std::size_t i = 0; i < count; ++i)
    names.push_back(clip(d.alternatives[i], kMaxName));
  out.put("alternatives", names);
}

void fill(Filler& out, const HealthDocument& d) {
  out.name("state", d.state);
  out.object()["channels"] = OrderedJson::array();
  const auto count = out.bounded("channels", d.channels.size(), kMaxChannels);
  for (std::size_t i = 0; i < count; ++i) {
    const ChannelHealth& c = d.channels[i];
    out.inner("channels", i)
        .name("channel", c.channel)
        .name("name", c.name)
        .name("unit", c.unit)
        .name("quality", c.quality)
        .number("age_s", c.age_s)
        .number("rate_hz", c.rate_hz)
        .number("value", c.value);
  }
  out.name("clock", d.clock).put("samples", d.samples).put("lost", d.lost);
  out.put("malformed", d.malformed).put("errors", d.errors).put("reconnects", d.reconnects);
  out.put("ring_overflows", d.ring_overflows).put("log_drops", d.log_drops);
  out.put("cycles_skipped", d.cycles_skipped).put("clients", d.clients);
  out.put("exciter_connected", d.exciter_connected).put("sensor_connected", d.sensor_connected);
  out.number("loop_late_max_s", d.loop_late_max_s).put("disk_free_bytes", d.disk_free_bytes);
  out.number("disk_flush_max_s", d.disk_flush_max_s);
}

// Standard deviations for people, the covariance for programs.
OrderedJson noise_of(const CycleNoiseEntry& d) {
  const std::size_t n = d.order.size();
  OrderedJson deviations = OrderedJson::array(), matrix = OrderedJson::array();
  for (std::size_t i = 0; i < n; ++i) {
    deviations.push_back(std::sqrt(std::max(0.0, d.covariance[i * n + i])));
    matrix.push_back(OrderedJson::array());
    for (std::size_t k = 0; k < n; ++k)
      matrix.back().push_back(d.covariance[i * n + k]);
  }
  return {{"cycles", d.cycles},
          {"unit", "m"},
          {"point", d.point_m},
          {"sensor", d.sensor_m},
          {"order", d.order},
          {"standard_deviation", std::move(deviations)},
          {"covariance", std::move(matrix)}};
}

void fill_noise(Filler& out, const CycleNoiseEntry& d) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (d.covariance.size() != d.order.size() * d.order.size() || d.order.size() > kMaxCovariance) {
    return out.omit("noise", "its covariance is not a square matrix of at most 64 rows");
  }
  if (!finite(d.point_m) || !finite(d.sensor_m) || !std::ranges::all_of(d.covariance, finite)) {
    return out.omit("noise", "an element is not finite");
  }
  out.put("noise", noise_of(d));
}

void fill(Filler& out, const RunStopDocument& d) {
  out.name("campaign", d.campaign).name("run", d.run).name("status", d.status);
  out.text("reason", d.reason).put("cycles_accepted", d.cycles_accepted);
  out.put("cycles_rejected", d.cycles_rejected);
  if (d.noise) fill_noise(out, *d.noise);
}

void fill(Filler& out, const DiagnosisProgressDocument& d) {
  out.name("campaign", d.campaign).name("stage", d.stage);
  out.number("share", std::clamp(d.share, 0.0, 1.0));
}

void fill(Filler& out, const DiagnosisResultDocument& d) {
  out.name("campaign", d.campaign).text("database", d.database).name("status", d.status);
  out.text("reason", d.reason);
  if (d.folder) out.text("folder", *d.folder);
  if (!d.diagnosis) return;
  OrderedJson content = OrderedJson::parse(*d.diagnosis, nullptr, false);
  if (content.is_discarded()) return out.omit("diagnosis", "it is not JSON");
  const std::size_t bytes =
      content.dump(-1, ' ', false, OrderedJson::error_handler_t::replace).size();
  if (bytes > kMaxDiagnosis) {
    return out.omit("diagnosis", fmt::format("{} bytes are too many for a line; it is in the "
                                             "folder's diagnosis.json",
                                             bytes));
  }
  out.put("diagnosis", std::move(content));
}

void fill_body(OrderedJson& json, const Document& document) {
  OrderedJson omitted = OrderedJson::array();
  Filler out(json, omitted, "");
  std::visit([&](const auto& d) { fill(out, d); }, document);
  if (!omitted.empty()) json["omitted"] = std::move(omitted);
}

}  // namespace

std::string_view type_name(const Document& document) {
  constexpr std::string_view names[] = {"version",
                                        "state",
                                        "run_start",
                                        "cycle",
                                        "estimate",
                                        "alarm",
                                        "health",
                                        "run_stop",
                                        "diagnosis_progress",
                                        "diagnosis_result",
                                        "wave",
                                        "scope",
                                        "rig"};
  static_assert(std::size(names) == std::variant_size_v<Document>);
  return names[document.index()];
}

std::string to_json_line(const Document& document, const Envelope& envelope) {
  OrderedJson json = {{"type", type_name(document)},
                      {"seq", envelope.seq},
                      {"t_utc", envelope.t_utc},
                      {"t_mono_ns", envelope.t_mono_ns}};
  fill_body(json, document);
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string to_json_text(const Document& document) {
  OrderedJson json = {{"type", type_name(document)}};
  fill_body(json, document);
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace shaker::protocol
