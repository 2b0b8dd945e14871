// verify: is a campaign as it was recorded? Its own checksums, and the seal over every byte.
#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <system_error>

#include "cli/commands.hpp"
#include "cli/config_check.hpp"
#include "cli/file_seal.hpp"
#include "cli/opened_campaign.hpp"
#include "record/verification.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;

struct Verdict {
  std::vector<std::string> facts, troubles;
  bool sealed = false, running = false;
};

Result<void> verify_database(const fs::path& file, Verdict& verdict) {
  const auto found = record::verify_campaign(file);
  if (!found) return found.error();
  verdict.running = found->running;
  verdict.facts.push_back(fmt::format("{}, {} samples, {} cycles, {} documents",
                                      report::counted(static_cast<std::size_t>(found->runs), "run"),
                                      found->samples, found->cycles, found->documents));
  if (!found->summed)
    verdict.facts.emplace_back("its rows have no checksums: a file of an earlier version");
  if (found->running)
    verdict.facts.emplace_back("it has no end: the daemon still records it, or died");
  verdict.troubles = found->troubles;
  return {};
}

void verify_folder(const fs::path& folder, Verdict& verdict) {
  const auto report = check_file(folder, {});
  verdict.facts = report.facts;
  verdict.troubles = report.errors;
}

// Compares with the seal, or with the hash of a report.
Result<void> verify_bytes(const fs::path& campaign, const VerifyOptions& options,
                          Verdict& verdict) {
  std::error_code none;
  if (!options.sha256.empty()) {
    const auto hash = fingerprint_of(campaign);
    if (!hash) return hash.error();
    verdict.sealed = true;
    if (*hash != options.sha256)
      verdict.troubles.push_back(fmt::format("its SHA-256 is {}, not {}", *hash, options.sha256));
    return {};
  }
  verdict.sealed = fs::exists(seal_of(campaign), none);
  if (!verdict.sealed) return {};
  const auto broken = broken_seal(campaign);
  if (!broken) return broken.error();
  verdict.troubles.insert(verdict.troubles.end(), broken->begin(), broken->end());
  return {};
}

// A damaged file's own words may be no text.
std::string legible(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';
  }
  return text;
}

int print_verdict(const Common& common, const fs::path& campaign, const Verdict& verdict) {
  const bool sound = verdict.troubles.empty();
  if (common.json) {
    const nlohmann::ordered_json body = {{"campaign", campaign.string()},
                                         {"sound", sound},
                                         {"sealed", verdict.sealed},
                                         {"facts", verdict.facts},
                                         {"troubles", verdict.troubles}};
    fmt::print("{}\n", body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return sound ? kOk : kNegative;
  }
  for (const std::string& fact : verdict.facts)
    fmt::print("{}\n", fact);
  std::fflush(stdout);
  for (const std::string& trouble : verdict.troubles)
    fmt::print(stderr, "shakerctl: {}: {}\n", campaign.string(), legible(trouble));
  if (!sound) return kNegative;
  fmt::print("{}\n", verdict.sealed
                         ? "sound: every byte is as it was sealed"
                         : "sound: every row and page fits. There is no seal, so bytes that hold "
                           "no content are not known; `shakerctl verify --seal` makes one");
  return kOk;
}

int verify_one(const Common& common, const fs::path& campaign, const VerifyOptions& options) {
  if (auto good = expect_campaign(campaign); !good)
    return fail(common, kBadInput, good.error().what);
  const bool folder = place_of(campaign) == Place::folder;
  Verdict verdict;
  if (folder) {
    verify_folder(campaign, verdict);
  } else if (auto done = verify_database(campaign, verdict); !done) {
    verdict.troubles.push_back(done.error().what);
  }
  if (options.seal && verdict.running)
    return fail(common, kBadInput,
                fmt::format("{}: has no end yet, so it is not sealed; wait for the campaign, or "
                            "start the daemon, which recovers it",
                            campaign.string()));
  if (options.seal && verdict.troubles.empty()) {
    if (auto sealed = write_seal(campaign); !sealed)
      return fail(common, kBadInput, sealed.error().what);
  }
  if (auto done = verify_bytes(campaign, options, verdict); !done)
    return fail(common, kBadInput, done.error().what);
  return print_verdict(common, campaign, verdict);
}

}  // namespace

int verify(const Common& common, const VerifyOptions& options) {
  if (!options.sha256.empty() && options.campaigns.size() != 1)
    return fail(common, kBadInput, "--sha256 is of one campaign; verify it alone");
  int worst = kOk;
  for (const fs::path& campaign : options.campaigns) {
    if (options.campaigns.size() > 1 && !common.json) fmt::print("{}:\n", campaign.string());
    worst = std::max(worst, verify_one(common, campaign, options));
  }
  return worst;
}

}  // namespace shaker::cli
