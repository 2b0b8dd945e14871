// What a user is called, for messages to people.
//
// From the local file alone. The C library's getpwuid asks whatever the PC is configured for (LDAP,
// sssd), which may take minutes when the network is gone, and this is asked at every connection.
#pragma once

#include <string>

#include <sys/types.h>

namespace shaker::daemon {

// "anna", or "uid 1234" for a user whom the file does not know. Waits for a local disk at most.
std::string user_name(uid_t uid, const char* file = "/etc/passwd");

}  // namespace shaker::daemon
