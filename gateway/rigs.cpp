#include "gateway/rigs.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <system_error>

namespace shaker::gateway {
namespace {

constexpr std::size_t kMaxRigName = 64;
constexpr const char* kViewSocket = "view.sock";

nlohmann::json entry_of(const ShownRig& rig) {
  nlohmann::json entry = {{"name", rig.name},
                          {"connected", rig.feed.connected()},
                          {"why", rig.feed.lost()},
                          {"errors", rig.feed.alarms("error")},
                          {"warnings", rig.feed.alarms("warning")}};
  const nlohmann::json* state = rig.feed.last("state");
  for (const char* key : {"state", "reason", "campaign", "run", "progress", "unprotected"}) {
    if (state != nullptr && state->contains(key)) entry[key] = state->at(key);
  }
  return entry;
}

}  // namespace

ShownRig& Rigs::add(const std::string& name, const std::filesystem::path& data) {
  auto rig = std::make_unique<ShownRig>(ShownRig{name, Feed(), Downloads(data)});
  const auto by_name = [](const auto& one) -> const std::string& { return one->name; };
  const auto place = std::ranges::lower_bound(all_, name, {}, by_name);
  return **all_.insert(place, std::move(rig));
}

const ShownRig* Rigs::find(std::string_view name) const {
  const auto found = std::ranges::find_if(all_, [&](const auto& rig) { return rig->name == name; });
  return found == all_.end() ? nullptr : found->get();
}

const ShownRig* Rigs::only() const {
  return all_.size() == 1 ? all_.front().get() : nullptr;
}

nlohmann::json Rigs::overview() const {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& rig : all_)
    list.push_back(entry_of(*rig));
  return {{"rigs", std::move(list)}};
}

Event Rigs::overview_event() const {
  return {event_text(overview().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace), 0,
                     "rigs")};
}

bool is_rig_name(std::string_view name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= kMaxRigName && name[0] != '.' &&
         std::ranges::all_of(name, good);
}

Result<RigSocket> rig_socket(const std::string& text) {
  const auto equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (equals == std::string::npos || equals + 1 == text.size())
    return Error{ErrorKind::invalid, fmt::format("--rig {}: give NAME=SOCKET, for example "
                                                 "left=/run/shakerd-view/left/view.sock",
                                                 text)};
  if (!is_rig_name(name))
    return Error{ErrorKind::invalid,
                 fmt::format("--rig {}: a name has letters, digits, _, - and ., at most {}, and "
                             "begins with no dot",
                             text, kMaxRigName)};
  return RigSocket{name, text.substr(equals + 1)};
}

std::vector<RigSocket> rig_sockets_in(const std::filesystem::path& folder) {
  std::vector<RigSocket> found;
  std::error_code trouble;
  const auto add = [&](const std::string& name, const std::filesystem::path& place) {
    std::error_code none;
    if (std::filesystem::is_socket(place / kViewSocket, none))
      found.push_back({name, place / kViewSocket});
  };
  add(kOnlyRig, folder);
  for (std::filesystem::directory_iterator it(folder, trouble), end; !trouble && it != end;
       it.increment(trouble)) {
    const std::string name = it->path().filename().string();
    if (is_rig_name(name) && name != kOnlyRig) add(name, it->path());
  }
  std::ranges::sort(found, {}, &RigSocket::name);
  return found;
}

}  // namespace shaker::gateway
