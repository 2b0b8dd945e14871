// Runs the whole blind suite of the diagnosis: see tests/blind/suite.hpp.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/heap.hpp"
#include "tests/blind/records.hpp"
#include "tests/blind/shards.hpp"
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

// Every so many-th of the cases of this kind ("": any) whose label holds `label`.
std::vector<Case> chosen_cases(int nulls, std::size_t every, const std::string& kind,
                               const std::string& label) {
  std::vector<Case> cases;
  std::size_t fitting = 0;
  for (Case& one : all_cases(nulls)) {
    if (one.label().find(label) == std::string::npos) continue;
    if (!kind.empty() && one.kind != kind) continue;
    if (fitting++ % every == 0) cases.push_back(std::move(one));
  }
  return cases;
}

void print_case(const Scored& s, std::size_t done, std::size_t of) {
  std::string names;
  for (const auto& effect : s.answer.effects) {
    names += fmt::format(" {} ({:.3f})", effect.name, effect.probability);
    for (const auto& rival : effect.confusable_with)
      names += " ~" + rival;
  }
  fmt::print(stderr,
             "{:5} of {}  {}  {}: {}{}{}  {:.4f} by chance  gap {:.2f} -> {:.2f} ({:.2f})  "
             "{:.2f} s\n",
             done, of, s.null ? (s.detected ? "!" : " ") : (s.in_set ? " " : "!"), s.hidden.label(),
             s.answer.verdict, names, s.answer.trouble, s.answer.by_chance, s.answer.gap_before,
             s.answer.gap_after, s.answer.noise_after, s.answer.seconds);
}

// Diagnoses the cases on `threads` threads, with their sealed files in a folder that is removed.
std::vector<Scored> diagnosed(const std::vector<Case>& cases, int threads, bool thorough) {
  std::string pattern = (std::filesystem::temp_directory_path() / "blind-suite.XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr)
    throw std::runtime_error(fmt::format("no folder can be made in {}",
                                         std::filesystem::temp_directory_path().string()));
  const std::filesystem::path folder = pattern;
  shaker::estimator::diagnosis::DiagnoseOptions options;
  if (thorough) options.evaluation_budget = shaker::estimator::diagnosis::kThorough;
  std::size_t done = 0;
  const auto tell = [&](const Scored& s) { print_case(s, ++done, cases.size()); };
  auto scored = run(cases, folder, threads, tell, options);
  std::filesystem::remove_all(folder);
  return scored;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Hides effects in the virtual rig and counts how often the workflow finds them.",
               "blind_suite");
  shaker::keep_freed_memory();  // the same as in shakerctl
  int nulls = 200, threads = 1, every = 1, records = 0;
  bool thorough = false;
  std::string kind, label, output, shard = "1/1", kept;
  std::vector<std::filesystem::path> parts;
  app.add_option("--nulls", nulls, "campaigns in which nothing is hidden")->capture_default_str();
  app.add_option("--threads", threads, "that work at once")->capture_default_str();
  app.add_option("--every", every, "only every so many-th case")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--kind", kind, "only cases of this kind");
  app.add_option("--label", label, "only cases whose label holds this: \"large, wide, quiet\"");
  app.add_flag("--thorough", thorough, "go on as long as there is more to try");
  app.add_option("--output", output, "write the tables into this file too");
  app.add_option("--shard", shard, "only this part of the cases: 3/7 is the third of seven")
      ->capture_default_str();
  app.add_option("--keep", kept, "write a line of JSON for each case into this file");
  app.add_option("--merge", parts, "the tables of files that parts with these options kept");
  app.add_option("--records", records,
                 "so many campaigns without a period instead, with something hidden; with "
                 "\"--kind nothing\" with nothing hidden");
  CLI11_PARSE(app, argc, argv);
  if (records > 0)
    return run_records(kind == "nothing" ? record_nulls(records) : record_effects(records), label);

  try {
    const auto cases = chosen_cases(nulls, static_cast<std::size_t>(every), kind, label);
    const shaker::Shard part = shaker::shard_from(shard);
    const auto scored =
        parts.empty() ? diagnosed(cases_of(cases, part), threads, thorough) : merge(cases, parts);
    if (!kept.empty()) keep(scored, part, kept);
    const std::string text = report(scored, 0.01);
    fmt::print("{}", text);
    if (!output.empty()) std::ofstream(output) << text;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_suite: {}\n", error.what());
    return 1;
  }
  return 0;
}
