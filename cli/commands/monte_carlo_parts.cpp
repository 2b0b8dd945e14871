#include "cli/commands/monte_carlo_parts.hpp"

#include <fstream>
#include <limits>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace shaker::cli {
namespace {

namespace est = shaker::estimator;
using Json = nlohmann::json;

constexpr std::string_view kFormat = "shaker-monte-carlo/1";

Json line_of(const est::Replication& r, std::size_t at) {
  return {{"at", at},
          {"status", static_cast<int>(r.status)},
          {"on_bound", r.on_bound},
          {"bias", static_cast<int>(r.bias)},
          {"noise", r.noise},
          {"theta", r.theta},
          {"error", r.error},
          {"inside", r.inside},
          {"inside_profile", r.inside_profile}};
}

// JSON writes what is not finite as null.
double number_in(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}
std::vector<double> numbers_in(const Json& values) {
  std::vector<double> numbers;
  for (const Json& value : values)
    numbers.push_back(number_in(value));
  return numbers;
}

est::Replication replication_in(const Json& line) {
  est::Replication r;
  r.status = static_cast<est::FitStatus>(line.at("status").get<int>());
  r.on_bound = line.at("on_bound");
  r.bias = static_cast<est::Correction>(line.at("bias").get<int>());
  r.noise = number_in(line.at("noise"));
  r.theta = numbers_in(line.at("theta"));
  r.error = numbers_in(line.at("error"));
  line.at("inside").get_to(r.inside);
  line.at("inside_profile").get_to(r.inside_profile);
  return r;
}

// Reads the files into the replications' places.
class Merged {
 public:
  Merged(long count, const std::string& description)
      : description_(description),
        all_(static_cast<std::size_t>(count)),
        seen_(static_cast<std::size_t>(count)) {}

  void read(const std::string& text, int number, const std::string& here) {
    try {
      const Json line = Json::parse(text);
      number == 1 ? take_head(line, here) : take(line, here);
    } catch (const Json::exception& error) {
      throw std::runtime_error(fmt::format("{}: not a kept replication: {}", here, error.what()));
    }
  }

  std::vector<est::Replication> whole() {
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      if (seen_[i].empty())
        throw std::runtime_error(
            fmt::format("no file has replication {}; run its part again", i + 1));
    }
    return std::move(all_);
  }

 private:
  void take_head(const Json& line, const std::string& here) const {
    if (line.at("format") != kFormat)
      throw std::runtime_error(fmt::format("{}: not a file of monte-carlo --keep", here));
    if (line.at("options") != Json::parse(description_))
      throw std::runtime_error(fmt::format(
          "{}: kept with other options: {}; here they are {}; give the same options as its part "
          "had",
          here, line.at("options").dump(), description_));
  }

  void take(const Json& line, const std::string& here) {
    const std::size_t at = line.at("at");
    if (at >= all_.size())
      throw std::runtime_error(
          fmt::format("{}: there are only {} replications", here, all_.size()));
    if (!seen_[at].empty())
      throw std::runtime_error(
          fmt::format("{}: replication {} is there twice, first in {}", here, at + 1, seen_[at]));
    seen_[at] = here;
    all_[at] = replication_in(line);
  }

  std::string description_;
  std::vector<est::Replication> all_;
  std::vector<std::string> seen_;  // where each was read; empty: not yet
};

}  // namespace

std::string described(const est::Model& model, const est::MonteCarloOptions& options) {
  Json runs = Json::array(), effects = Json::array();
  for (const est::RunDesign& run : options.runs)
    runs.push_back({run.frequency_hz, run.amplitude, run.points, run.cycles});
  for (const auto terms : {model.terms(), model.instruments()}) {
    for (const est::Model::Term& term : terms)
      effects.push_back(std::string(term.effect->name()));
  }
  return Json{{"model", model.name()},
              {"effects", effects},
              {"truth", options.truth},
              {"runs", runs},
              {"noise", options.noise},
              {"uniform", options.kind == est::NoiseKind::uniform},
              {"replications", options.replications},
              {"seed", options.seed},
              {"profile", options.profile},
              {"bias", est::name(options.bias)}}
      .dump();
}

void keep(const std::vector<est::Replication>& part, const Shard& shard,
          const std::string& description, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << Json{{"format", kFormat}, {"options", Json::parse(description)}}.dump() << '\n';
  for (std::size_t k = 0; k < part.size(); ++k)
    out << line_of(part[k], shard.index - 1 + k * shard.count).dump() << '\n';
  out.close();
  if (!out) throw std::runtime_error(fmt::format("{}: cannot be written", file.string()));
}

std::vector<est::Replication> merge(long count, const std::string& description,
                                    const std::vector<std::filesystem::path>& files) {
  Merged merged(count, description);
  each_kept_line(files, [&](const std::string& text, int number, const std::string& here) {
    merged.read(text, number, here);
  });
  return merged.whole();
}

}  // namespace shaker::cli
