#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "tests/blind/suite.hpp"

namespace shaker::blind {
namespace {

constexpr std::size_t kFewestChances = 20;

struct Share {
  int hits = 0, of = 0;
  void count(bool hit) {
    ++of;
    hits += hit ? 1 : 0;
  }
  std::string text() const {
    if (of == 0) return "-";
    return fmt::format("{:.1f} % ({} of {})", 100.0 * hits / of, hits, of);
  }
};

std::string figures(const std::vector<Scored>& all, double rate) {
  Share alarms, in_set, first, sure, told, outside, detected, gap, noise, pairs;
  double seconds = 0.0, slowest = 0.0;
  for (const Scored& s : all) {
    seconds += s.answer.seconds / static_cast<double>(all.size());
    slowest = std::max(slowest, s.answer.seconds);
    if (s.answer.verdict == "explained") {
      gap.count(s.answer.gap_after <= 1.1);
      noise.count(s.answer.noise_after <= 1.1);
    }
    if (s.null) {
      alarms.count(s.detected);
      continue;
    }
    detected.count(s.detected);
    if (!s.detected) continue;
    sure.count(s.wrong_and_sure);
    if (!s.in_catalogue) {
      outside.count(s.answer.verdict == "unexplained");
    } else if (s.hidden.kind.find(" + ") != std::string::npos) {
      pairs.count(s.in_set);
    } else {
      in_set.count(s.in_set);
      first.count(s.named_first);
      if (s.told_apart) told.count(s.named_first);
    }
  }
  std::string text = "| figure | wanted | found |\n|---|---|---|\n";
  const auto row = [&](std::string_view what, const std::string& wanted, const std::string& found) {
    text += fmt::format("| {} | {} | {} |\n", what, wanted, found);
  };
  row("false alarms where nothing is missing", fmt::format("{:.1f} %", 100 * rate), alarms.text());
  row("something missing, and seen", "", detected.text());
  row("seen: the true effect named, or in the reported set", "97 %", in_set.text());
  row("seen: the true effect named first", "", first.text());
  row("seen, and no rival reported: named first", "90 %", told.text());
  row("a wrong name, first or further, with probability > 0.95", "at most 1 %", sure.text());
  row("two at once: both named or in a reported set", "", pairs.text());
  row("in no catalogue, and seen: `unexplained`", "90 %", outside.text());
  row("`explained`: gap after at most 1.1 x noise floor", "all", gap.text());
  row("`explained`: gap after at most 1.1 x the expected noise", "", noise.text());
  row("processor time of a diagnosis, mean and slowest", "2 s",
      fmt::format("{:.2f} s, {:.2f} s", seconds, slowest));
  return text;
}

std::string by_kind(const std::vector<Scored>& all) {
  struct Row {
    Share seen, first, set, unexplained;
  };
  std::vector<std::string> order;
  std::map<std::string, Row> rows;
  for (const Scored& s : all) {
    if (!rows.contains(s.hidden.kind)) order.push_back(s.hidden.kind);
    Row& row = rows[s.hidden.kind];
    row.seen.count(s.detected);
    if (!s.detected) continue;
    row.first.count(s.named_first);
    row.set.count(s.in_set);
    row.unexplained.count(s.answer.verdict == "unexplained");
  }
  std::string text =
      "| hidden | seen | of these named first | named or in the set | unexplained |\n"
      "|---|---|---|---|---|\n";
  const auto brief = [](const Share& s) { return fmt::format("{} / {}", s.hits, s.of); };
  for (const auto& kind : order) {
    const Row& row = rows[kind];
    text += fmt::format("| {} | {} | {} | {} | {} |\n", kind, brief(row.seen), brief(row.first),
                        brief(row.set), brief(row.unexplained));
  }
  return text;
}

// Rows: hidden effect; columns: the first selected effect, or the verdict if there is none.
std::string confusion(const std::vector<Scored>& all) {
  std::map<std::string, std::map<std::string, int>> counts;
  for (const Scored& s : all) {
    const auto& a = s.answer;
    ++counts[s.hidden.kind]
            [a.effects.empty() || a.verdict == "unexplained" ? a.verdict : a.effects[0].name];
  }
  std::string text = "| hidden | first named (times) |\n|---|---|\n";
  for (const auto& [kind, answers] : counts) {
    std::vector<std::pair<int, std::string>> sorted;
    for (const auto& [name, times] : answers)
      sorted.emplace_back(-times, name);
    std::ranges::sort(sorted);
    std::string cells;
    for (const auto& [times, name] : sorted)
      cells += fmt::format("{}{} {}", cells.empty() ? "" : ", ", name, -times);
    text += fmt::format("| {} | {} |\n", kind, cells);
  }
  return text;
}

// How often a selected effect is right, against its stated probability. When the hidden effect
// is in no catalogue, every selected effect is wrong.
std::string calibration_of_names(const std::vector<Scored>& all) {
  constexpr double kEdges[] = {0.0, 0.1, 0.5, 0.8, 0.95, 0.99, 1.0 + 1e-9};
  constexpr std::size_t kBins = std::size(kEdges) - 1;
  struct Row {
    Share first, further;
    double stated_first = 0.0, stated_further = 0.0;
  };
  std::vector<Row> rows(kBins);
  for (const Scored& s : all) {
    for (std::size_t e = 0; e < s.answer.effects.size(); ++e) {
      const Named& named = s.answer.effects[e];
      std::size_t bin = 0;
      while (bin + 1 < kBins && named.probability >= kEdges[bin + 1])
        ++bin;
      const bool right =
          (" + " + s.hidden.kind + " + ").find(" + " + named.name + " + ") != std::string::npos;
      (e == 0 ? rows[bin].first : rows[bin].further).count(right);
      (e == 0 ? rows[bin].stated_first : rows[bin].stated_further) += named.probability;
    }
  }
  std::string text =
      "| stated probability | first name: stated, right | further names: stated, right |\n"
      "|---|---|---|\n";
  const auto cell = [](const Share& share, double stated) {
    if (share.of == 0) return std::string("-");
    return fmt::format("{:.1f} %, {}", 100.0 * stated / share.of, share.text());
  };
  for (std::size_t b = kBins; b-- > 0;)
    text += fmt::format("| {:.2f} .. {:.2f} | {} | {} |\n", kEdges[b], std::min(1.0, kEdges[b + 1]),
                        cell(rows[b].first, rows[b].stated_first),
                        cell(rows[b].further, rows[b].stated_further));
  return text;
}

// When nothing is hidden, the stated probability of such a gap by chance is uniform on 0..1.
std::string chances_of_nulls(const std::vector<Scored>& all) {
  constexpr int kTenths = 10;
  std::vector<double> chances;
  std::vector<int> counts(kTenths, 0);
  Share hundredth, twentieth;
  for (const Scored& s : all) {
    if (!s.null || s.answer.verdict == "refused") continue;
    const double p = s.answer.by_chance;
    chances.push_back(p);
    ++counts[static_cast<std::size_t>(std::clamp(static_cast<int>(kTenths * p), 0, kTenths - 1))];
    hundredth.count(p <= 0.01);
    twentieth.count(p <= 0.05);
  }
  if (chances.size() < kFewestChances) return {};
  std::string tenths;
  for (const int count : counts)
    tenths += fmt::format("{}{}", tenths.empty() ? "" : " ", count);
  const Evenness even = evenness(chances);
  return fmt::format(
      "| nothing hidden: the probability by chance that is stated | found |\n|---|---|\n"
      "| in each tenth of 0..1 | {} |\n| at most 0.01 | {} |\n| at most 0.05 | {} |\n"
      "| Kolmogorov: largest distance from an even one, and its chance | {:.3f}, {:.2f} |\n\n",
      tenths, hundredth.text(), twentieth.text(), even.distance, even.chance);
}

}  // namespace

// Kolmogorov's distribution, with Stephens' correction for few draws (J. R. Stat. Soc. B 32,
// 1970).
Evenness evenness(std::vector<double> chances) {
  std::sort(chances.begin(), chances.end());
  const auto n = static_cast<double>(chances.size());
  Evenness even;
  for (std::size_t i = 0; i < chances.size(); ++i) {
    const auto below = static_cast<double>(i);
    even.distance =
        std::max({even.distance, (below + 1.0) / n - chances[i], chances[i] - below / n});
  }
  const double t = (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(n)) * even.distance;
  double sum = 0.0;
  for (int k = 1; k <= 100; ++k)
    sum += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * k * k * t * t);
  even.chance = t < 0.2 ? 1.0 : std::clamp(sum, 0.0, 1.0);  // the series converges slowly there
  return even;
}

std::string report(const std::vector<Scored>& scored, double false_alarm_rate) {
  return figures(scored, false_alarm_rate) + "\n" + chances_of_nulls(scored) +
         calibration_of_names(scored) + "\n" + by_kind(scored) + "\n" + confusion(scored);
}

}  // namespace shaker::blind
