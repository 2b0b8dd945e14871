#include "cli/diagnosed_data.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/campaign_folder.hpp"
#include "record/campaign_database.hpp"
#include "record/provenance.hpp"

namespace shaker::cli {
namespace {

using estimator::diagnosis::Campaign;
using estimator::diagnosis::Recording;

constexpr std::size_t kShownDigits = 12;  // of a hash in a sentence

std::string hash_of_run(const Recording& run) {
  std::string bytes;
  for (const auto* column :
       {&run.t, &run.displacement, &run.excitation, &run.force, &run.acceleration}) {
    bytes += fmt::format("{} ", column->size());
    bytes.append(reinterpret_cast<const char*>(column->data()), column->size() * sizeof(double));
  }
  return record::sha256(bytes);
}

std::string hash_of_runs(std::vector<std::string> runs) {
  std::sort(runs.begin(), runs.end());
  return record::sha256(fmt::format("{}", fmt::join(runs, " ")));
}

std::vector<std::string> hashes_of_runs(const Campaign& campaign) {
  std::vector<std::string> hashes;
  for (const Recording& run : campaign.runs)
    hashes.push_back(hash_of_run(run));
  return hashes;
}

std::string in_words(const std::string& name, const std::string& specimen,
                     const std::string& hash) {
  return fmt::format("{} ({}{}data {})", name, specimen, specimen.empty() ? "" : ", ",
                     hash.substr(0, kShownDigits));
}

}  // namespace

std::string hash_of_data(const Campaign& campaign) {
  return hash_of_runs(hashes_of_runs(campaign));
}

std::string specimen_of(const std::vector<std::filesystem::path>& campaigns) {
  for (const auto& place : campaigns) {
    if (std::filesystem::is_directory(place)) continue;
    const auto reader = record::CampaignReader::open(place);
    const auto facts = reader ? reader->facts() : Result<std::vector<record::Fact>>(reader.error());
    if (!facts) continue;
    std::vector<std::string> said;
    for (const record::Fact& fact : *facts) {
      if (fact.kind == "specimen" && (fact.name == "name" || fact.name == "serial"))
        said.push_back(fact.name + " " + fact.value);
    }
    if (!said.empty()) return fmt::format("{}", fmt::join(said, ", "));
  }
  return "";
}

void put_origin(const Campaign& campaign, const std::vector<std::filesystem::path>& places,
                estimator::IdentifiedDamper& damper) {
  damper.data = hash_of_data(campaign);
  damper.specimen = specimen_of(places);
}

Result<void> expect_origin(const estimator::IdentifiedDamper& damper,
                           const std::filesystem::path& folder,
                           const std::vector<std::filesystem::path>& places) {
  if (damper.data.empty() || places.empty()) return {};
  std::vector<std::string> hashes, names;
  for (const auto& place : places) {
    config::ModelSpec model = damper.hypotheses.front().model;
    const auto campaign = read_campaign(place, model);
    if (!campaign) return campaign.error();
    for (std::string& hash : hashes_of_runs(*campaign))
      hashes.push_back(std::move(hash));
    names.push_back(place.string());
  }
  const std::string hash = hash_of_runs(std::move(hashes));
  if (hash == damper.data) return {};
  const std::string asked = fmt::format("{}", fmt::join(names, " "));
  return Error{ErrorKind::invalid,
               fmt::format("{} is the diagnosis of {}, not of {}; give the folder that `shakerctl "
                           "diagnose {} --out FOLDER` wrote, or leave --diagnosis out",
                           folder.string(), in_words(damper.campaign, damper.specimen, damper.data),
                           in_words(asked, specimen_of(places), hash), asked)};
}

}  // namespace shaker::cli
