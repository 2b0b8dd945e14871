#include "tests/dirty/write.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/dirty/random.hpp"

namespace shaker::dirty {
namespace {

using Json = nlohmann::ordered_json;

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written", path.string()));
}

// White and coloured noise of one channel.
class ChannelNoise {
 public:
  ChannelNoise(const Noise& noise, double deviation, double step, Random& random)
      : random_(random),
        colour_(random, step, noise.time),
        white_part_(deviation * std::sqrt(1.0 - noise.coloured)),
        coloured_part_(deviation * std::sqrt(noise.coloured)) {}
  double next() { return white_part_ * random_.normal() + coloured_part_ * colour_.next(); }

 private:
  Random& random_;
  ColouredNoise colour_;
  double white_part_;
  double coloured_part_;
};

std::string csv(const Campaign& c, const Run& run, Random& random) {
  const Effects hidden = all_hidden(c);
  const Channels channels = moved(Device(c.base, hidden, c.weight), hidden, run);
  const bool imposed = run.drive == Drive::kImposed;
  ChannelNoise input(c.noise, c.noise.input, run.step, random);
  ChannelNoise response(c.noise, c.noise.response, run.step, random);
  std::string text = imposed ? "t,displacement,force\n"
                             : (run.excited() ? "t,excitation,displacement\n" : "t,displacement\n");
  for (std::size_t k = 0; k < channels.time.size(); ++k) {
    text += fmt::format("{:.9g}", channels.time[k]);
    if (!channels.input.empty()) text += fmt::format(",{:.9g}", channels.input[k] + input.next());
    const double value = quantised(channels.response[k] + response.next(), quantum(hidden));
    text += fmt::format(",{:.9g}\n", imposed ? value * c.true_mass : value);
  }
  return text;
}

Json campaign_json(const Campaign& c) {
  const bool imposed = c.kind == "imposed";
  Json units = {{"time", "s"}, {"displacement", "m"}};
  if (imposed) units["force"] = "N";
  if (c.runs.front().excited()) units["excitation"] = "m/s^2";
  Json file = {{"format", "shaker-campaign/1"}, {"units", units}};
  if (imposed) file["reference_mass"] = c.stated_mass;
  file["gravity"] = kGravity;
  for (std::size_t i = 0; i < c.runs.size(); ++i) {
    Json run = {{"name", fmt::format("r{}", i)}, {"file", fmt::format("r{}.csv", i)}};
    if (c.kind == "periodic" || imposed) {
      run["frequency_hz"] = c.stated_frequency[i];
      run["amplitude"] = c.runs[i].amplitude;
    }
    if (imposed) run["kind"] = "imposed_motion";
    if (c.kind != "periodic" && !imposed) run["kind"] = "transient";
    file["runs"].push_back(run);
  }
  return file;
}

Json model_json(const Campaign& c) {
  const auto effect = [&](const char* name, std::initializer_list<const char*> parameters) {
    Json entry = {{"effect", name}};
    for (const char* p : parameters)
      entry["parameters"][p] = {{"start", c.starts.at(p)}, {"lower", 0}};
    return entry;
  };
  Json file = {
      {"format", "shaker-model/1"}, {"name", "base"}, {"gravity", kGravity}, {"length_unit", "m"}};
  if (c.base.contains("theta1")) {
    file["effects"] = {effect("orifice_damping", {"theta1"}),
                       effect("gas_spring", {"theta2", "theta3", "theta4"})};
    Json& theta4 = file["effects"][1]["parameters"]["theta4"];
    theta4["lower"] = 0.5;
    theta4["upper"] = 2;
    if (c.weight) file["effects"].push_back({{"effect", "gravity"}});
  } else {
    file["effects"] = {effect("viscous_damping", {"c"}), effect("linear_stiffness", {"k"})};
  }
  return file;
}

Json truth_json(const Campaign& c) {
  Json runs;
  for (const Run& run : c.runs)
    runs.push_back({{"frequency_hz", run.frequency},
                    {"zero", run.change.zero},
                    {"preload", run.change.preload},
                    {"temperature", run.change.temperature}});
  // The answer's gap is in the units of the campaign: a force over the stated mass.
  const double scale = c.kind == "imposed" ? c.true_mass / c.stated_mass : 1.0;
  Json visible = Json::object();
  for (const auto& [name, size] : c.visible)
    visible[name] = size * scale;
  return {{"format", "shaker-dirty-truth/1"},
          {"index", c.index},
          {"seed", c.seed},
          {"kind", c.kind},
          {"holds", c.holds},
          {"base", c.base},
          {"effects", c.effects},
          {"unknown", c.unknown},
          {"visible", visible},
          {"gap_alone", c.gap_alone * scale},
          {"motion", c.motion * scale},
          {"noise", c.noise.response * scale},
          {"changes", c.changes},
          {"runs", runs}};
}

}  // namespace

void write_campaign(const Campaign& c, const std::filesystem::path& folder) {
  const std::string name = fmt::format("{:06}", c.index);
  const std::filesystem::path inside = folder / name;
  std::filesystem::create_directories(inside);
  Random random(c.seed ^ (static_cast<std::uint64_t>(c.index) << 20U));
  random = Random(random.bits() + 1);
  for (std::size_t i = 0; i < c.runs.size(); ++i)
    write_text(inside / fmt::format("r{}.csv", i), csv(c, c.runs[i], random));
  write_text(inside / "campaign.json", campaign_json(c).dump(2) + "\n");
  write_text(inside / "model.json", model_json(c).dump(2) + "\n");
  write_text(folder / (name + ".truth.json"), truth_json(c).dump(2) + "\n");
}

}  // namespace shaker::dirty
