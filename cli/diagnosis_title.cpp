#include "cli/diagnosis_title.hpp"

#include "cli/made_by.hpp"
#include "cli/utc_text.hpp"

namespace shaker::cli {
namespace {

// Specimen and operator, as far as the database knows them.
void add_facts(const std::filesystem::path& campaign, report::TitleBlock& title) {
  const auto reader = record::CampaignReader::open(campaign);
  const auto facts = reader ? reader->facts() : Result<std::vector<record::Fact>>(reader.error());
  if (!facts) return;
  std::string specimen, who;
  for (const record::Fact& fact : *facts) {
    if (fact.kind == "specimen")
      specimen += (specimen.empty() ? "" : ", ") + fact.name + " " + fact.value;
    if (fact.kind == "person" && fact.name == "started by") who = fact.value;
  }
  if (!specimen.empty()) title.emplace_back("specimen", specimen);
  if (!who.empty()) title.emplace_back("operator", who);
}

}  // namespace

report::TitleBlock title_of(const std::filesystem::path& campaign,
                            const std::optional<record::CampaignRow>& row) {
  std::error_code none;
  const auto whole = std::filesystem::weakly_canonical(campaign, none);
  report::TitleBlock title;
  if (row) {
    title.emplace_back("rig", row->rig);
    add_facts(campaign, title);
    title.emplace_back("measured", row->finished_utc.empty()
                                       ? readable_utc(row->started_utc)
                                       : readable_utc(row->started_utc) + " to " +
                                             readable_utc(row->finished_utc) + ", " + row->status);
  }
  title.emplace_back("data", (whole.empty() ? campaign : whole).string());
  title.emplace_back("diagnosed", made_by());
  return title;
}

}  // namespace shaker::cli
