// What the gateway answers to one request. Knows no connection.
//
// /rig/NAME/ has the page of a rig and all that belongs to it. The root has the same where there is
// one rig, and otherwise the list of them.
//
// A path is compared with the names that there are, and never becomes a file's path.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "gateway/downloads.hpp"
#include "gateway/metrics.hpp"
#include "gateway/rigs.hpp"

namespace shaker::gateway {

struct PageRequest {
  std::string_view method, path, host;  // `path` without its query, decoded
};

struct Reply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string_view shared;  // the body, if it is one of web_files
  std::string body;         // otherwise
  std::optional<Download> file = {};
  std::string file_name = {};     // for a file to save
  bool events = false;            // the stream of events
  const ShownRig* rig = nullptr;  // whose; null: what there is of all rigs
  std::string location = {};      // where the browser is sent on to
};

// Every answer has it. The page fetches nothing from elsewhere and runs no inline script.
inline constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
    "data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
// That of a report: one file with its own styles and pictures, and no script.
inline constexpr const char* kReportPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action "
    "'none'; frame-ancestors 'none'; sandbox";

Reply answer_to(const PageRequest& request, const Rigs& rigs, const GatewayFigures& figures);

// True for this PC's own names. A page of another site that has its name resolved to 127.0.0.1
// sends its own.
bool is_own_host(std::string_view host);

}  // namespace shaker::gateway
