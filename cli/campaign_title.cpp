#include "cli/campaign_title.hpp"

#include "cli/file_seal.hpp"
#include "cli/made_by.hpp"
#include "cli/utc_text.hpp"

namespace shaker::cli {

report::TitleBlock campaign_title(const std::vector<std::filesystem::path>& campaigns,
                                  const std::optional<record::CampaignRow>& row,
                                  const std::string& done, const TitleWords& words) {
  report::TitleBlock title = {{"specimen", words.specimen}, {"serial number", words.serial}};
  title.emplace_back("rig", words.rig.empty() && row ? row->rig : words.rig);
  title.emplace_back("operator", words.operator_name);
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
