// Names of users, for messages, and identifiers of groups.
//
// Reads the local files only. The C library's getpwuid and getgrnam use the PC's configuration
// (LDAP, sssd), which may take minutes when the network is gone. These functions are called at
// the start and for every connection.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace shaker::daemon {

// Returns "anna", or "uid 1234" for a user who is not in the file. Waits for a local disk at
// most.
std::string user_name(uid_t uid, const char* file = "/etc/passwd");

std::optional<gid_t> group_id(std::string_view name, const char* file = "/etc/group");

}  // namespace shaker::daemon
