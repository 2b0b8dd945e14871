#include "gateway/page_request.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

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
                                  name.empty() ? "file without a name" : quoted(name)));
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

Reply sent_on(std::string location) {
  Reply reply = plain(308, "The page is at " + location);
  reply.location = std::move(location);
  return reply;
}

Reply events_of(const ShownRig* rig) {
  Reply reply;
  reply.type = "text/event-stream";
  reply.events = true;
  reply.rig = rig;
  return reply;
}

Reply metrics_reply(const std::vector<RigFeed>& rigs, const GatewayFigures& figures) {
  Reply reply;
  reply.type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body = metrics(rigs, figures);
  return reply;
}

// `first`: the file at "/".
Reply web_file(std::string_view path, std::string_view first) {
  const auto found = std::ranges::find(web_files, path == "/" ? first : path, &WebFile::path);
  if (found == web_files.end())
    return plain(404, fmt::format("There is nothing at {}; the page is at /.", quoted(path)));
  Reply reply;
  reply.type = type_of(found->path);
  reply.shared = found->content;
  return reply;
}

Reply of_rig(const ShownRig& rig, std::string_view path, const GatewayFigures& figures) {
  if (path == "/events") return events_of(&rig);
  if (path == "/metrics") return metrics_reply({{"", &rig.feed}}, figures);
  if (path == "/campaigns.json") return json_reply(rig.downloads.list());
  if (const auto name = below(path, "/campaigns/")) {
    Reply reply = file_reply(rig.downloads.campaign(*name), *name, "application/vnd.sqlite3");
    if (reply.file) reply.file_name = *name;
    return reply;
  }
  if (const auto name = below(path, "/reports/"))
    return file_reply(rig.downloads.report(*name), *name, "text/html; charset=utf-8");
  return web_file(path, "/index.html");
}

Reply of_all(const Rigs& rigs, std::string_view path, const GatewayFigures& figures) {
  if (path == "/events") return events_of(nullptr);
  if (path == "/rigs.json") return json_reply(rigs.overview());
  if (path != "/metrics") return web_file(path, "/rigs.html");
  std::vector<RigFeed> feeds;
  for (const auto& rig : rigs.all())
    feeds.push_back({rig->name, &rig->feed});
  return metrics_reply(feeds, figures);
}

}  // namespace

bool is_own_host(std::string_view host) {
  if (host.empty()) return true;  // HTTP/1.0, or a program
  if (const auto colon = host.rfind(':'); colon != std::string_view::npos && host.back() != ']')
    host = host.substr(0, colon);
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

Reply answer_to(const PageRequest& request, const Rigs& rigs, const GatewayFigures& figures) {
  if (!is_own_host(request.host))
    return plain(421,
                 fmt::format("This gateway serves 127.0.0.1 and localhost, not \"{}\"; a proxy "
                             "in front of it sends Host: 127.0.0.1.",
                             quoted(request.host)));
  if (request.method != "GET" && request.method != "HEAD")
    return plain(405, "The gateway only shows: use GET. Commands go through shakerctl.");
  if (const auto rest = below(request.path, "/rig/")) {
    const std::string_view name = rest->substr(0, rest->find('/'));
    const ShownRig* rig = rigs.find(name);
    if (rig == nullptr)
      return plain(404,
                   fmt::format("There is no rig {}; / lists those that there are.", quoted(name)));
    if (rest->size() == name.size()) return sent_on(rig->name + "/");
    return of_rig(*rig, rest->substr(name.size()), figures);
  }
  if (const ShownRig* rig = rigs.only()) return of_rig(*rig, request.path, figures);
  return of_all(rigs, request.path, figures);
}

}  // namespace shaker::gateway
