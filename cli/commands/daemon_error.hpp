// Reports an error of the connection, or a refusal by the daemon, and returns the exit code.
// For the commands that talk to the daemon.
#pragma once

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "cli/documents_in.hpp"
#include "cli/stream_client.hpp"

namespace shaker::cli {

inline int unreachable(const Common& common, const Error& error) {
  return fail(common, kUnreachable, printable(error.what));
}
inline int refused(const Common& common, const Answer& answer) {
  return fail(common, kRefused, "the daemon refuses: " + printable(answer.message));
}

}  // namespace shaker::cli
