#include "gateway/page_request.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "gateway/web_files.hpp"

namespace shaker::gateway {
namespace {

constexpr std::array kTypes = {std::pair{".html", "text/html; charset=utf-8"},
                               std::pair{".js", "text/javascript; charset=utf-8"},
                               std::pair{".css", "text/css; charset=utf-8"},
                               std::pair{".svg", "image/svg+xml"}};

std::string type_of(std::string_view path) {
  for (const auto& [ending, type] : kTypes) {
    if (path.ends_with(ending)) return type;
  }
  return "application/octet-stream";
}

Reply plain(unsigned status, std::string sentence) {
  Reply reply;
  reply.status = status;
  reply.body = std::move(sentence) + "\n";
  return reply;
}

// Printable and short, for a sentence that quotes it.
std::string quoted(std::string_view path) {
  std::string text;
  for (const char c : path.substr(0, 80))
    text += c >= ' ' && c < 127 ? c : '?';
  return text + (path.size() > 80 ? "..." : "");
}

std::optional<std::string_view> below(std::string_view path, std::string_view folder) {
  if (!path.starts_with(folder)) return std::nullopt;
  return path.substr(folder.size());
}

Reply file_reply(std::optional<Download> file, std::string_view name, std::string type) {
  if (!file)
    return plain(404, fmt::format("There is no {} to download; /campaigns.json lists what there "
                                  "is. A campaign that is being recorded is not given yet.",
                                  quoted(name)));
  Reply reply;
  reply.type = std::move(type);
  reply.file = std::move(file);
  return reply;
}

Reply json_reply(const nlohmann::json& json) {
  Reply reply;
  reply.type = "application/json";
  reply.body = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return reply;
}

}  // namespace

bool is_own_host(std::string_view host) {
  if (host.empty()) return true;  // HTTP/1.0, or a program
  if (const auto colon = host.rfind(':'); colon != std::string_view::npos && host.back() != ']')
    host = host.substr(0, colon);
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

Reply answer_to(const PageRequest& request, const Feed& feed, const GatewayFigures& figures,
                const Downloads& downloads) {
  if (!is_own_host(request.host))
    return plain(421,
                 fmt::format("This gateway serves 127.0.0.1 and localhost, not \"{}\"; a proxy "
                             "in front of it sends Host: 127.0.0.1.",
                             quoted(request.host)));
  if (request.method != "GET" && request.method != "HEAD")
    return plain(405, "The gateway only shows: use GET. Commands go through shakerctl.");
  const std::string_view path = request.path == "/" ? "/index.html" : request.path;
  if (path == "/events") {
    Reply reply;
    reply.type = "text/event-stream";
    reply.events = true;
    return reply;
  }
  if (path == "/metrics") {
    Reply reply;
    reply.type = "text/plain; version=0.0.4; charset=utf-8";
    reply.body = metrics(feed, figures);
    return reply;
  }
  if (path == "/campaigns.json") return json_reply(downloads.list());
  if (const auto name = below(path, "/campaigns/")) {
    Reply reply = file_reply(downloads.campaign(*name), *name, "application/vnd.sqlite3");
    if (reply.file) reply.file_name = *name;
    return reply;
  }
  if (const auto name = below(path, "/reports/"))
    return file_reply(downloads.report(*name), *name, "text/html; charset=utf-8");
  const auto found = std::ranges::find(web_files, path, &WebFile::path);
  if (found == web_files.end())
    return plain(404, fmt::format("There is nothing at {}; the page is at /.", quoted(path)));
  Reply reply;
  reply.type = type_of(path);
  reply.shared = found->content;
  return reply;
}

}  // namespace shaker::gateway
