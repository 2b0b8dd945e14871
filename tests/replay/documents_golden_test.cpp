// Replays a recorded log through driver, engine and estimator on the simulated clock and
// compares the stream of documents with the golden file.
//
// SHAKER_UPDATE_GOLDEN=1 writes new golden files instead (README.md).
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "daemon/simulated_campaign.hpp"
#include "record/campaign_database.hpp"

namespace shaker::daemon {
namespace {

using Json = nlohmann::json;
const std::filesystem::path kFolder =
    std::filesystem::path(SHAKER_SOURCE_DIR) / "tests" / "replay" / "documents";

// Kept are the results of instruments and method. Left out are counts of the optimiser's steps
// and properties of the machine.
Json body(const protocol::Document& document) {
  Json json = Json::parse(protocol::to_json_text(document));
  for (const char* key : {"iterations", "latency_s", "disk_free_bytes", "loop_late_max_s"})
    json.erase(key);
  return json;
}

// "0.2 s after 14 cycles" -> "# s after # cycles"
std::string without_numbers(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const bool digit = std::isdigit(static_cast<unsigned char>(text[i])) != 0;
    if (!digit) {
      out += text[i++];
      continue;
    }
    while (i < text.size() && (std::isdigit(static_cast<unsigned char>(text[i])) ||
                               std::string_view(".e+-").find(text[i]) != std::string_view::npos))
      ++i;
    out += '#';
  }
  return out;
}

// Empty when they agree: numbers to `relative` of the golden value, or to `absolute`.
std::string difference(const Json& is, const Json& golden, const std::string& where,
                       double relative, double absolute) {
  if (golden.is_number() && is.is_number()) {
    const double a = is.get<double>(), b = golden.get<double>();
    if (std::abs(a - b) <= std::max(absolute, relative * std::abs(b))) return {};
    return fmt::format("{}: {} instead of {}", where, a, b);
  }
  if (golden.is_string() && is.is_string()) {
    const auto a = without_numbers(is), b = without_numbers(golden);
    return a == b ? std::string() : fmt::format("{}: \"{}\" instead of \"{}\"", where, a, b);
  }
  if (is.type() != golden.type() || is.size() != golden.size()) {
    return fmt::format("{}: {} instead of {}", where, is.dump(), golden.dump());
  }
  if (!golden.is_structured()) {
    return is == golden ? std::string()
                        : fmt::format("{}: {} instead of {}", where, is.dump(), golden.dump());
  }
  // Estimates may differ by a hundredth of their standard error.
  double own = absolute;
  if (golden.is_object() && golden.contains("standard_error")) {
    own = std::max(own, 0.01 * golden["standard_error"].get<double>());
  }
  for (const auto& [key, value] : golden.items()) {
    const Json* other = nullptr;
    if (golden.is_array()) {
      other = &is[std::stoul(key)];
    } else if (is.contains(key)) {
      other = &is[key];
    }
    if (!other) return fmt::format("{}/{} is missing", where, key);
    const bool scatter = key == "covariance" || key == "correlation" || key == "noise" ||
                         key == "sum_of_squares" || key == "change" || key == "condition" ||
                         key == "standard_error" || key == "noise_standard_deviation";
    const double loose = scatter ? 0.02 : relative;
    const double least = key == "correlation" ? 0.01 : key == "noise" ? 1e-12 : own;
    if (auto found = difference(*other, value, where + "/" + key, loose, least); !found.empty())
      return found;
  }
  return {};
}

// Writes the Modbus log as the campaign database that the daemon would have written.
void write_database(const std::filesystem::path& target) {
  SimulatedClock clock;
  const auto rig = config::load_rig(kFolder / "rig_modbus.json");
  ASSERT_TRUE(rig) << rig.error().what;
  const auto devices = drivers::make_devices(*rig, clock);
  ASSERT_TRUE(devices) << devices.error().what;
  record::CampaignRow campaign;
  campaign.name = "golden";
  campaign.started_utc = "2026-03-01T12:00:00.000Z";
  auto writer = record::CampaignWriter::create(target.parent_path(), campaign);
  ASSERT_TRUE(writer) << writer.error().what;
  ASSERT_TRUE(writer->add_run({0, "r01", 2.5, 3.0, 5}));
  auto& sensor = *devices->sensors[0];
  ASSERT_TRUE(sensor.connect());
  std::vector<drivers::Sample> samples(64);
  while (!sensor.finished()) {
    const auto count = sensor.read(samples, from_seconds(0.1));
    ASSERT_TRUE(count);
    std::vector<record::SampleRow> rows;
    for (const auto& s : std::span(samples).first(*count))
      rows.push_back({s.t.count(), s.value, s.channel, static_cast<std::uint8_t>(s.quality)});
    ASSERT_TRUE(writer->add_samples(0, rows));
  }
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:01:00.000Z"));
  std::filesystem::rename(writer->file(), target);
}

class DocumentsGolden : public testing::TestWithParam<std::string> {
 protected:
  DocumentsGolden() {
    std::string name = testing::TempDir() + "documents_XXXXXX";
    scratch_ = ::mkdtemp(name.data());
  }
  ~DocumentsGolden() override { std::filesystem::remove_all(scratch_); }
  std::filesystem::path scratch_;
};

void expect_the_truth(const protocol::EstimateDocument& last) {
  const std::map<std::string, double> truth = {
      {"theta1", 16.6667}, {"theta2", 1.524}, {"theta3", 5.31496}, {"theta4", 1.0}};
  for (const auto& p : last.parameters) {
    if (!truth.contains(p.name)) continue;
    EXPECT_NEAR(p.value, truth.at(p.name), 4.0 * p.standard_error + 1e-3 * truth.at(p.name))
        << p.name;
  }
}

TEST_P(DocumentsGolden, OfARecordedLogAreThoseThatStandBesideIt) {
  auto rig = config::load_rig(kFolder / ("rig_" + GetParam() + ".json"));
  ASSERT_TRUE(rig) << rig.error().what;
  if (GetParam() == "database") {
    write_database(scratch_ / "oleo.db");
    if (HasFatalFailure()) return;
    rig->directory = scratch_;
  }
  const auto campaign = config::load_campaign(kFolder / "campaign.json");
  ASSERT_TRUE(campaign) << campaign.error().what;
  SimulationOptions options;
  options.at_most_s = 60.0;
  const auto result = run_simulated_campaign(*rig, *campaign, options);
  ASSERT_TRUE(result) << result.error().what;

  const auto file = kFolder / (GetParam() + ".golden");
  if (std::getenv("SHAKER_UPDATE_GOLDEN") != nullptr) {
    std::ofstream out(file);
    for (const auto& document : result->documents)
      out << body(document).dump() << '\n';
  }
  std::ifstream in(file);
  std::size_t i = 0;
  for (std::string line; std::getline(in, line); ++i) {
    ASSERT_LT(i, result->documents.size()) << "the stream ends before " << line;
    const auto found = difference(body(result->documents[i]), Json::parse(line), "", 1e-4, 1e-9);
    ASSERT_TRUE(found.empty()) << "document " << i << ": " << found << "\n"
                               << body(result->documents[i]).dump();
  }
  EXPECT_EQ(i, result->documents.size());

  int estimates = 0;
  const protocol::EstimateDocument* last = nullptr;
  for (const auto& document : result->documents) {
    if (const auto* e = std::get_if<protocol::EstimateDocument>(&document)) {
      ++estimates;
      last = e;
    }
  }
  ASSERT_EQ(estimates, 5);
  EXPECT_TRUE(last->usable);
  expect_the_truth(*last);
}

INSTANTIATE_TEST_SUITE_P(, DocumentsGolden,
                         testing::Values("modbus", "can", "database", "simulated"),
                         [](const auto& which) { return which.param; });

}  // namespace
}  // namespace shaker::daemon
