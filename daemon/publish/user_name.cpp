#include "daemon/publish/user_name.hpp"

#include <array>
#include <cstdio>
#include <grp.h>
#include <memory>
#include <pwd.h>

#include <fmt/format.h>

namespace shaker::daemon {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::string user_name(uid_t uid, const char* file) {
  const std::unique_ptr<std::FILE, CloseFile> users(std::fopen(file, "re"));
  std::array<char, 4096> buffer;  // of one line
  passwd entry{}, *found = nullptr;
  while (users && ::fgetpwent_r(users.get(), &entry, buffer.data(), buffer.size(), &found) == 0) {
    if (entry.pw_uid == uid) return entry.pw_name;
  }
  return fmt::format("uid {}", uid);
}

std::optional<gid_t> group_id(std::string_view name, const char* file) {
  const std::unique_ptr<std::FILE, CloseFile> groups(std::fopen(file, "re"));
  std::array<char, 16384> buffer;  // for one line with its members
  group entry{}, *found = nullptr;
  while (groups && ::fgetgrent_r(groups.get(), &entry, buffer.data(), buffer.size(), &found) == 0) {
    if (name == entry.gr_name) return entry.gr_gid;
  }
  return std::nullopt;
}

}  // namespace shaker::daemon
