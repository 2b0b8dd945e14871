#include "cli/campaign_title.hpp"

#include "cli/file_seal.hpp"
#include "cli/made_by.hpp"
#include "cli/utc_text.hpp"
#include "record/provenance.hpp"

namespace shaker::cli {
namespace {

// Specimen and operator, as far as the database knows them and nobody has said otherwise.
void add_facts(const std::filesystem::path& campaign, TitleWords& words) {
  const auto reader = record::CampaignReader::open(campaign);
  const auto facts = reader ? reader->facts() : Result<std::vector<record::Fact>>(reader.error());
  if (!facts) return;
  std::string specimen;
  for (const record::Fact& fact : *facts) {
    if (fact.kind == "specimen" && fact.name == "serial" && words.serial.empty())
      words.serial = fact.value;
    else if (fact.kind == "specimen")
      specimen += (specimen.empty() ? "" : ", ") + (fact.name == "name" ? "" : fact.name + " ") +
                  fact.value;
    if (fact.kind == "person" && fact.name == "started by" && words.operator_name.empty())
      words.operator_name = fact.value;
  }
  if (words.specimen.empty()) words.specimen = specimen;
}

}  // namespace

report::TitleBlock campaign_title(const std::vector<std::filesystem::path>& campaigns,
                                  const std::optional<record::CampaignRow>& row,
                                  const std::string& done, const TitleWords& words) {
  TitleWords known = words;
  if (row && !campaigns.empty()) add_facts(campaigns.front(), known);
  report::TitleBlock title = {{"specimen", known.specimen}, {"serial number", known.serial}};
  title.emplace_back("rig", known.rig.empty() && row ? row->rig : known.rig);
  title.emplace_back("operator", known.operator_name);
  if (row) {
    title.emplace_back("measured", row->finished_utc.empty()
                                       ? readable_utc(row->started_utc)
                                       : readable_utc(row->started_utc) + " to " +
                                             readable_utc(row->finished_utc) + ", " + row->status);
  }
  const bool written = row && row->finished_utc.empty();
  for (const std::filesystem::path& campaign : campaigns) {
    std::error_code none;
    const auto whole = std::filesystem::weakly_canonical(campaign, none);
    title.emplace_back("data", (whole.empty() ? campaign : whole).string());
    const auto hash = written ? Result<std::string>(Error{}) : fingerprint_of(campaign);
    if (hash) title.emplace_back("SHA-256", *hash);
  }
  if (!words.model.empty()) {
    title.emplace_back("model file", words.model.string());
    const auto hash = sha256_of(words.model);
    if (hash) title.emplace_back("SHA-256", *hash);
  }
  title.emplace_back(done, made_by());
  return title;
}

}  // namespace shaker::cli
