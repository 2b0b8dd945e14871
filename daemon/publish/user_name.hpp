// What a user is called, for messages to people, and which group may connect.
//
// From the local files alone. The C library's getpwuid and getgrnam ask whatever the PC is configured for (LDAP,
// sssd), which may take minutes when the network is gone; this is asked at the start and at every
// connection.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace shaker::daemon {

// "anna", or "uid 1234" for a user whom the file does not know. Waits for a local disk at most.
std::string user_name(uid_t uid, const char* file = "/etc/passwd");

std::optional<gid_t> group_id(std::string_view name, const char* file = "/etc/group");

}  // namespace shaker::daemon
