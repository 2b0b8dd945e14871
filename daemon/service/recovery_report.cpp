#include "daemon/service/recovery_report.hpp"

#include <exception>

#include <fmt/format.h>

namespace shaker::daemon {
namespace {

void say(const record::Recovered& found, const RecoveryTell& tell) {
  const char* code = found.damaged            ? "campaign_damaged"
                     : found.campaign.empty() ? "campaign_unreadable"
                                              : "campaign_interrupted";
  tell({found.damaged ? "error" : "warning", code, found.what, "none", {}, {}, {}});
}

void say_unchecked(const std::filesystem::path& file, const char* why, const RecoveryTell& tell) {
  record::Recovered unchecked;
  unchecked.what =
      fmt::format("{}: cannot be checked ({}); start the daemon again.", file.string(), why);
  say(unchecked, tell);
}

}  // namespace

void report_recovery(const std::filesystem::path& file, const RecoveryCheck& check,
                     const RecoveryTell& tell) noexcept {
  try {
    try {
      if (const auto found = check(file)) say(*found, tell);
    } catch (const std::exception& trouble) {
      say_unchecked(file, trouble.what(), tell);
    }
  } catch (...) {
    // There is no memory for the message. The next start checks the file again.
  }
}

}  // namespace shaker::daemon
