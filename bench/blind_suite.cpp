// Runs the whole blind suite of the diagnosis: see tests/blind/suite.hpp.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/heap.hpp"
#include "tests/blind/records.hpp"
#include "tests/blind/suite.hpp"

namespace {

using namespace shaker::blind;

// Campaigns of records without a period, instead of the rig's campaigns.
int run_records(const std::vector<RecordCase>& all, const std::string& label) {
  std::vector<ScoredRecord> scored;
  for (const RecordCase& wanted : all) {
    if (wanted.label().find(label) == std::string::npos) continue;
    scored.push_back({wanted, answer(wanted)});
    const Answer& a = scored.back().answer;
    std::string names;
    for (const auto& effect : a.effects)
      names += fmt::format(" {} ({:.3f})", effect.name, effect.probability);
    fmt::print(stderr, "{}: {}{}{}  {:.4f} by chance  gap {:.2f} -> {:.2f} ({:.2f})  {:.2f} s\n",
               wanted.label(), a.verdict, names, a.trouble, a.by_chance, a.gap_before, a.gap_after,
               a.noise_after, a.seconds);
  }
  fmt::print("{}", report(scored));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Hides effects in the virtual rig and counts how often the workflow finds them.",
               "blind_suite");
  shaker::keep_freed_memory();  // the same as in shakerctl
  int nulls = 200, threads = 1, every = 1;
  int records = 0;
  bool thorough = false;
  std::string kind, label, output;
  app.add_option("--nulls", nulls, "campaigns in which nothing is hidden")->capture_default_str();
  app.add_option("--threads", threads, "that work at once")->capture_default_str();
  app.add_option("--every", every, "only every so many-th case")->capture_default_str();
  app.add_option("--kind", kind, "only cases of this kind");
  app.add_option("--label", label, "only cases whose label holds this: \"large, wide, quiet\"");
  app.add_flag("--thorough", thorough, "go on as long as there is more to try");
  app.add_option("--output", output, "write the tables into this file too");
  app.add_option("--records", records,
                 "so many campaigns without a period instead, with something hidden; with "
                 "\"--kind nothing\" with nothing hidden");
  CLI11_PARSE(app, argc, argv);
  if (records > 0)
    return run_records(kind == "nothing" ? record_nulls(records) : record_effects(records), label);

  std::vector<Case> cases;
  const auto all = all_cases(nulls);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].label().find(label) == std::string::npos) continue;
    if (kind.empty() || all[i].kind == kind) cases.push_back(all[i]);
  }
  for (std::size_t i = 0; i < cases.size(); ++i)
    cases[i / static_cast<std::size_t>(every)] = cases[i - i % static_cast<std::size_t>(every)];
  cases.resize((cases.size() + static_cast<std::size_t>(every) - 1) /
               static_cast<std::size_t>(every));
  // A folder of its own, because two runs may work at the same time.
  std::string pattern = (std::filesystem::temp_directory_path() / "blind-suite.XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    fmt::print(stderr, "blind_suite: no folder can be made in {}\n",
               std::filesystem::temp_directory_path().string());
    return 1;
  }
  const std::filesystem::path folder = pattern;
  shaker::estimator::discrepancy::DiagnoseOptions options;
  if (thorough) options.effort = shaker::estimator::discrepancy::kThorough;
  std::size_t done = 0;
  const auto tell = [&](const Scored& s) {
    std::string names;
    for (const auto& effect : s.answer.effects) {
      names += fmt::format(" {} ({:.3f})", effect.name, effect.probability);
      for (const auto& rival : effect.confusable_with)
        names += " ~" + rival;
    }
    fmt::print(stderr,
               "{:5} of {}  {}  {}: {}{}{}  {:.4f} by chance  gap {:.2f} -> {:.2f} ({:.2f})  "
               "{:.2f} s\n",
               ++done, cases.size(), s.null ? (s.detected ? "!" : " ") : (s.in_set ? " " : "!"),
               s.hidden.label(), s.answer.verdict, names, s.answer.trouble, s.answer.by_chance,
               s.answer.gap_before, s.answer.gap_after, s.answer.noise_after, s.answer.seconds);
  };
  const auto scored = run(cases, folder, threads, tell, options);
  std::filesystem::remove_all(folder);
  const std::string text = report(scored, 0.01);
  fmt::print("{}", text);
  if (!output.empty()) std::ofstream(output) << text;
  return 0;
}
