#include "cli/diagnosis_title.hpp"

#include "cli/made_by.hpp"
#include "cli/utc_text.hpp"

namespace shaker::cli {
report::TitleBlock title_of(const std::filesystem::path& campaign,
                            const std::optional<record::CampaignRow>& row) {
  std::error_code none;
  const auto whole = std::filesystem::weakly_canonical(campaign, none);
  report::TitleBlock title;
  if (row) {
    title.emplace_back("rig", row->rig);
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
