// The dossier: campaign, estimate, diagnosis and drop on one page that loads nothing and can be
// printed. Every number on it can be computed again by the commands that it prints.
#pragma once

#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/diagnosed_drop.hpp"
#include "cli/opened_campaign.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "report/page/page.hpp"

namespace shaker::cli {

struct Dossier {
  report::TitleBlock title;
  const OpenedCampaign* opened = nullptr;
  const estimator::diagnosis::Diagnosis* diagnosis = nullptr;
  const DiagnosedDrop* drop = nullptr;  // null: no drop was asked for, or it gives no answer
  std::string no_drop;                  // why there is none; empty: it was not asked for
  std::vector<std::string> commands;
};

// Pure. Throws std::logic_error for a mistake in a template.
std::string dossier_page(const Dossier& dossier);

// What the template `drop` shows, and a page of that alone.
report::PageValues drop_values(const DiagnosedDrop& drop);
std::string drop_page(const DiagnosedDrop& drop, const report::TitleBlock& title);

// The commands that compute everything on the page again, the last one the page itself.
std::vector<std::string> dossier_commands(const ReportOptions& options);

}  // namespace shaker::cli
