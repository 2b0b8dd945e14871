// Reads measured campaigns from their folder.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/csv.hpp"
#include "estimator/diagnosis/diagnose.hpp"

namespace shaker::estimator::diagnosis::testing {

inline std::filesystem::path data_folder() {
  const char* said = std::getenv("SHAKER_REAL_DATA");
  return said != nullptr ? said : SHAKER_REAL_DATA;
}

class RealData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (data_folder().empty() || !std::filesystem::is_directory(data_folder()))
      GTEST_SKIP() << "SHAKER_REAL_DATA names no folder of real measurements";
  }
};

struct Column {
  std::string name;
  double scale = 1.0;
};

inline std::vector<double> take(const cli::CsvTable& table, const Column& column,
                                std::size_t first = 0, std::size_t last = SIZE_MAX) {
  if (column.name.empty()) return {};
  const auto& whole = table.columns.at(column.name);
  std::vector<double> some;
  for (std::size_t i = first; i < std::min(last, whole.size()); ++i)
    some.push_back(column.scale * whole[i]);
  return some;
}

inline cli::CsvTable table_of(const std::string& file, const std::vector<Column>& columns) {
  std::vector<std::string> names = {"time_s"};
  for (const Column& c : columns) {
    if (!c.name.empty()) names.push_back(c.name);
  }
  const auto table = cli::read_csv(data_folder() / file, {names});
  EXPECT_TRUE(table) << table.error().what;
  return table ? *table : cli::CsvTable{};
}

inline Recording transient(const std::string& file, const Column& excitation,
                           const Column& displacement, Role role, std::size_t first = 0,
                           std::size_t last = SIZE_MAX) {
  const auto table = table_of(file, {excitation, displacement});
  Recording r;
  r.name = file.substr(file.find('/') + 1);
  r.kind = Kind::transient;
  r.role = role;
  r.role_given = true;
  if (table.columns.empty()) return r;
  r.t = take(table, {"time_s"}, first, last);
  r.excitation = take(table, excitation, first, last);
  r.displacement = take(table, displacement, first, last);
  return r;
}

inline config::EffectSpec line(const std::string& effect) {
  config::EffectSpec spec;
  spec.effect = effect;
  return spec;
}

// The effect with start and bounds of a parameter.
inline config::EffectSpec line(const std::string& effect, const std::string& symbol, double start,
                               double lower, double upper) {
  config::EffectSpec spec = line(effect);
  spec.parameters[symbol].start = start;
  spec.parameters[symbol].lower = lower;
  spec.parameters[symbol].upper = upper;
  return spec;
}

// A constant force: weight, or the zero offset of a load cell.
inline config::EffectSpec offset_force() {
  config::EffectSpec spec = line("offset_force", "b", 0.0, -100.0, 100.0);
  spec.formula = "b";
  spec.parameters["b"].unit = "m/s^2";
  return spec;
}

inline std::vector<std::string> names(const Diagnosis& d) {
  std::vector<std::string> list;
  for (const NamedEffect& e : d.effects)
    list.push_back(e.name);
  return list;
}

inline void print(const Diagnosis& d) {
  std::printf("%s: gap %.4g -> %.4g, noise floor %.3g", name(d.verdict), d.gap.before, d.gap.after,
              d.gap.noise_floor);
  if (d.gap.held_out_before)
    std::printf(", held out %.4g -> %.4g", *d.gap.held_out_before, *d.gap.held_out_after);
  for (const NamedEffect& e : d.effects)
    std::printf("; %s %.2f", e.name.c_str(), e.probability);
  std::printf("\n");
  for (std::size_t i = 0; i < d.ranking.size() && i < 8; ++i)
    std::printf("  %-22s gain %.3g refitted %.3g %s\n", d.ranking[i].name.c_str(),
                d.ranking[i].gain, d.ranking[i].gain_refitted.value_or(0.0),
                d.ranking[i].disqualified.c_str());
  for (const RunGap& r : d.runs)
    std::printf("  %-28s %3d cycles, gap %.4g -> %.4g, noise floor %.3g\n", r.name.c_str(),
                r.cycles, r.before, r.after, r.noise_floor);
  for (const auto& p : d.parameters_before)
    std::printf("  before %s.%s = %.6g +- %.2g %s\n", p.effect.c_str(), p.name.c_str(), p.value,
                p.standard_error, p.at_bound ? "(bound)" : "");
  for (const auto& p : d.parameters_after)
    std::printf("  after  %s.%s = %.6g +- %.2g %s\n", p.effect.c_str(), p.name.c_str(), p.value,
                p.standard_error, p.at_bound ? "(bound)" : "");
  std::printf("  %s\n", d.location.words.c_str());
  for (const std::string& warning : d.warnings)
    std::printf("  note: %s\n", warning.c_str());
  std::fflush(stdout);
}

}  // namespace shaker::estimator::diagnosis::testing
