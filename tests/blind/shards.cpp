#include "tests/blind/shards.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace shaker::blind {
namespace {

using Line = nlohmann::json;

// JSON has no infinity and no NaN: they are written as text.
Line number_from(double value) {
  return std::isfinite(value) ? Line(value) : Line(fmt::format("{}", value));
}
double number_in(const Line& line) {
  return line.is_string() ? std::stod(line.get<std::string>()) : line.get<double>();
}

Line line_of(const Scored& s, std::size_t at) {
  Line effects = Line::array();
  for (const Named& n : s.answer.effects)
    effects.push_back(
        {{"name", n.name}, {"probability", n.probability}, {"confusable", n.confusable_with}});
  return {{"at", at},
          {"case", s.hidden.label()},
          {"verdict", s.answer.verdict},
          {"trouble", s.answer.trouble},
          {"effects", effects},
          {"gap_before", number_from(s.answer.gap_before)},
          {"gap_after", number_from(s.answer.gap_after)},
          {"by_chance", number_from(s.answer.by_chance)},
          {"noise_after", number_from(s.answer.noise_after)},
          {"seconds", number_from(s.answer.seconds)},
          {"null", s.null},
          {"in_catalogue", s.in_catalogue},
          {"detected", s.detected},
          {"named_first", s.named_first},
          {"in_set", s.in_set},
          {"told_apart", s.told_apart},
          {"wrong_and_sure", s.wrong_and_sure}};
}

Scored scored_from(const Line& line, const Case& hidden) {
  Scored s{hidden, {}};
  Answer& a = s.answer;
  line.at("verdict").get_to(a.verdict);
  line.at("trouble").get_to(a.trouble);
  for (const Line& n : line.at("effects"))
    a.effects.push_back({n.at("name"), n.at("probability"), n.at("confusable")});
  a.gap_before = number_in(line.at("gap_before"));
  a.gap_after = number_in(line.at("gap_after"));
  a.by_chance = number_in(line.at("by_chance"));
  a.noise_after = number_in(line.at("noise_after"));
  a.seconds = number_in(line.at("seconds"));
  line.at("null").get_to(s.null);
  line.at("in_catalogue").get_to(s.in_catalogue);
  line.at("detected").get_to(s.detected);
  line.at("named_first").get_to(s.named_first);
  line.at("in_set").get_to(s.in_set);
  line.at("told_apart").get_to(s.told_apart);
  line.at("wrong_and_sure").get_to(s.wrong_and_sure);
  return s;
}

}  // namespace

std::vector<Case> cases_of(const std::vector<Case>& all, const Shard& shard) {
  std::vector<Case> some;
  for (std::size_t i = shard.index - 1; i < all.size(); i += shard.count)
    some.push_back(all[i]);
  return some;
}

void keep(const std::vector<Scored>& part, const Shard& shard, const std::filesystem::path& file) {
  std::ofstream out(file);
  for (std::size_t k = 0; k < part.size(); ++k)
    out << line_of(part[k], shard.index - 1 + k * shard.count).dump() << '\n';
  out.close();
  if (!out) throw std::runtime_error(fmt::format("{}: cannot be written", file.string()));
}

namespace {

// Puts the case of a line into its place. `seen`: the places of the lines so far.
void place(const Line& line, const std::string& here, std::vector<Scored>& merged,
           std::vector<std::string>& seen) {
  const std::size_t at = line.at("at");
  const std::string label = line.at("case");
  if (at >= merged.size() || merged[at].hidden.label() != label)
    throw std::runtime_error(
        fmt::format("{}: the suite of these options has no case {}, \"{}\"", here, at, label));
  if (!seen[at].empty())
    throw std::runtime_error(fmt::format("{}: the case {}, \"{}\", is there twice, first in {}",
                                         here, at, label, seen[at]));
  seen[at] = here;
  merged[at] = scored_from(line, merged[at].hidden);
}

}  // namespace

std::vector<Scored> merge(const std::vector<Case>& all,
                          const std::vector<std::filesystem::path>& files) {
  std::vector<Scored> merged;
  for (const Case& one : all)
    merged.push_back({one, {}});
  std::vector<std::string> seen(all.size());
  each_kept_line(files, [&](const std::string& text, int, const std::string& here) {
    try {
      place(Line::parse(text), here, merged, seen);
    } catch (const Line::exception& error) {
      throw std::runtime_error(fmt::format("{}: not a kept case: {}", here, error.what()));
    }
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (seen[i].empty())
      throw std::runtime_error(
          fmt::format("no file has the case {}, \"{}\"; run its part again", i, all[i].label()));
  }
  return merged;
}

}  // namespace shaker::blind
