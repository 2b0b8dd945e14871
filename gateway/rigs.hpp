// The rigs that one gateway shows. One thread.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "gateway/downloads.hpp"
#include "gateway/feed.hpp"

namespace shaker::gateway {

// The name of the rig that has none: of the service without a name, and of --socket.
inline constexpr const char* kOnlyRig = "shakerd";

struct ShownRig {
  std::string name;  // in paths: /rig/NAME/
  Feed feed;
  Downloads downloads;
};

class Rigs {
 public:
  // Precondition: is_rig_name(name), and there is none of that name. The reference stays valid.
  ShownRig& add(const std::string& name, const std::filesystem::path& data);
  const ShownRig* find(std::string_view name) const;  // null: there is none
  const ShownRig* only() const;                       // null unless there is exactly one
  const std::vector<std::unique_ptr<ShownRig>>& all() const { return all_; }

  // {"rigs": [{"name", "connected", "why", "state", "reason", "campaign", "run", "progress",
  // "errors", "warnings"}]} in the order of the names; what is unknown is left out.
  nlohmann::json overview() const;
  Event overview_event() const;  // the event "rigs" with the same

 private:
  std::vector<std::unique_ptr<ShownRig>> all_;
};

struct RigSocket {
  std::string name;
  std::filesystem::path socket;
};

// Letters, digits, '_', '-' and '.', at most 64, and no '.' in front.
bool is_rig_name(std::string_view name);
// "NAME=SOCKET". An Error says what is wrong.
Result<RigSocket> rig_socket(const std::string& text);
// The sockets of a folder as systemd makes them: NAME/view.sock, and view.sock itself, whose rig is
// called "shakerd". Sorted by name; none if the folder cannot be read.
std::vector<RigSocket> rig_sockets_in(const std::filesystem::path& folder);

}  // namespace shaker::gateway
