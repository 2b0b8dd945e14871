#include "daemon/service/diagnosis_desk.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "record/campaign_files.hpp"

namespace shaker::daemon {
namespace {

constexpr std::size_t kLongestFolder = 120;

bool at_rest(State state) {
  return state == State::idle || state == State::fault;
}

// Checks that `wanted` names one folder in the daemon's directory and no database.
Result<std::string> folder_name(const std::string& wanted, const std::filesystem::path& database) {
  if (wanted.empty()) return database.stem().string() + ".diagnosis";
  const bool plain = std::ranges::all_of(wanted, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
  if (!plain || wanted.front() == '.' || wanted.ends_with(".db") || wanted.size() > kLongestFolder)
    return Error{
        ErrorKind::invalid,
        fmt::format("\"out\" is the name of a folder in the daemon's own directory: letters, "
                    "digits, - _ and ., at most {} of them, not ending in .db.",
                    kLongestFolder)};
  return wanted;
}

}  // namespace

Result<DiagnosisPlace> DiagnosisDesk::begin(const DiagnosisRequest& request, State state) {
  if (!at_rest(state))
    return Error{ErrorKind::refused,
                 fmt::format("The rig is in {}: a diagnosis waits until the campaign is over.",
                             name(state))};
  if (checking_)
    return Error{ErrorKind::refused,
                 "The daemon is still checking what an earlier one left behind; ask again when it "
                 "has said what it found."};
  if (thread_.busy())
    return Error{ErrorKind::refused,
                 "A diagnosis is under way already; wait for its end, or ask for diagnose.cancel."};
  auto database = record::find_campaign(directory_, request.campaign);
  if (!database) return database.error();
  const auto folder = folder_name(request.out, *database);
  if (!folder) return folder.error();
  DiagnosisJob job{*database, directory_ / *folder, {}, request.false_alarm_rate, request.thorough};
  if (request.model) {
    auto model = config::parse_model(*request.model, "diagnose: /params/model");
    if (!model) return model.error();
    job.model = std::move(*model);
  }
  const DiagnosisPlace place{database->filename().string(),
                             std::filesystem::absolute(job.folder).string()};
  thread_.begin(std::move(job));
  return place;
}

Result<void> DiagnosisDesk::cancel(const std::string& who) {
  if (!thread_.busy()) return Error{ErrorKind::refused, "No diagnosis is under way."};
  thread_.cancel(fmt::format("Cancelled by {}.", who));
  return {};
}

void DiagnosisDesk::watch(State state) {
  if (!at_rest(state))
    thread_.cancel("A campaign was started, and comes first; ask again when it is over.");
}

}  // namespace shaker::daemon
