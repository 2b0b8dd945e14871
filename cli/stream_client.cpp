#include "cli/stream_client.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "protocol/rpc.hpp"

namespace shaker::cli {
namespace {

constexpr int kGreetMs = 5000, kAnswerMs = 10000;
constexpr const char* kGone = "shakerd closed the connection; look at `journalctl -u shakerd`";

Error connect_error(const std::string& socket, int code) {
  switch (code) {
    case ENOENT:
    case ECONNREFUSED:
      return {
          ErrorKind::unavailable,
          fmt::format("{}: there is no daemon ({}); start it with `systemctl start shakerd`, or "
                      "say where its socket is with --socket or SHAKERD_SOCKET",
                      socket, std::strerror(code))};
    case EACCES:
    case EPERM:
      return {ErrorKind::refused,
              fmt::format("{}: permission denied; be a member of the group shaker (`adduser USER "
                          "shaker`, then log in again)",
                          socket)};
    default:
      return {ErrorKind::unavailable, fmt::format("{}: {}", socket, std::strerror(code))};
  }
}

}  // namespace

Result<StreamClient> StreamClient::connect(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = socket.string();
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return Error{ErrorKind::invalid,
                 fmt::format("\"{}\" is no socket's path; 1 to {} bytes are allowed", path,
                             sizeof address.sun_path - 1)};
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!fd.valid()) return Error{ErrorKind::io, fmt::format("socket: {}", std::strerror(errno))};
  const void* raw = &address;
  if (::connect(fd.get(), static_cast<const sockaddr*>(raw), sizeof address) != 0) {
    return connect_error(path, errno);
  }
  StreamClient client(std::move(fd));
  if (auto greeted = client.greet(path); !greeted) return greeted.error();
  return client;
}

Result<void> StreamClient::greet(const std::string& socket) {
  const auto wait = next(kGreetMs, version_line_);
  if (!wait) {
    return Error{ErrorKind::exhausted,
                 fmt::format("{}: the daemon closed the connection at once; it may have as many "
                             "clients as it allows, or be stopping",
                             socket)};
  }
  if (*wait != Wait::line) {
    return Error{ErrorKind::timeout,
                 fmt::format("{}: no greeting within {} s; the daemon is still starting, or "
                             "hangs, or something else listens there",
                             socket, kGreetMs / 1000)};
  }
  version_ = nlohmann::json::parse(version_line_, nullptr, false);
  Answer refusal;
  if (version_.is_object() && is_answer(version_, refusal) && refusal.refused) {
    return Error{ErrorKind::exhausted, refusal.message};
  }
  if (!version_.is_object() || version_.value("type", "") != "version" ||
      !version_.contains("protocol") || !version_["protocol"].is_number_integer()) {
    return Error{ErrorKind::refused,
                 fmt::format("{}: what listens there is not shakerd: its first line is no "
                             "\"version\" document",
                             socket)};
  }
  const auto protocol = version_["protocol"].get<std::int64_t>();
  if (protocol == kProtocol) return {};
  return Error{ErrorKind::refused,
               fmt::format("{}: the daemon speaks protocol {}, this shakerctl {}; install the {}",
                           socket, protocol, kProtocol,
                           protocol > kProtocol ? "shakerctl that came with the daemon"
                                                : "newer daemon and restart it")};
}

Result<StreamClient::Wait> StreamClient::next(int timeout_ms, std::string& line) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::milliseconds(timeout_ms);
  for (;;) {
    if (const auto end = buffer_.find('\n', searched_); end != std::string::npos) {
      line.assign(buffer_, 0, end);
      buffer_.erase(0, end + 1);
      searched_ = 0;
      return Wait::line;
    }
    searched_ = buffer_.size();
    if (buffer_.size() > kMaxLine) {
      return Error{ErrorKind::invalid, fmt::format("a line longer than {} bytes came from the "
                                                   "daemon; is it shakerd?",
                                                   kMaxLine)};
    }
    int left = -1;
    if (timeout_ms >= 0) {
      const auto rest = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
      left = static_cast<int>(std::max<std::int64_t>(0, rest.count()));
    }
    pollfd waiting{fd_.get(), POLLIN, 0};
    const int ready = ::poll(&waiting, 1, left);
    if (ready < 0 && errno == EINTR) return Wait::interrupted;
    if (ready < 0) return Error{ErrorKind::io, fmt::format("poll: {}", std::strerror(errno))};
    if (ready == 0) return Wait::timeout;
    char chunk[65536];
    const ssize_t got = ::recv(fd_.get(), chunk, sizeof chunk, 0);
    if (got < 0 && errno == EINTR) return Wait::interrupted;
    if (got <= 0) return Error{ErrorKind::unavailable, kGone};
    buffer_.append(chunk, static_cast<std::size_t>(got));
  }
}

Result<std::int64_t> StreamClient::send(const std::string& method, const nlohmann::json& params) {
  const std::string line = protocol::request_line(++last_id_, method, params) + "\n";
  if (line.size() > protocol::kMaxRequestLine) {
    return Error{ErrorKind::invalid, fmt::format("{}: {} bytes; the daemon takes {} in one request",
                                                 method, line.size(), protocol::kMaxRequestLine)};
  }
  std::size_t sent = 0;
  while (sent < line.size()) {
    const ssize_t n = ::send(fd_.get(), line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Error{ErrorKind::unavailable, kGone};
    sent += static_cast<std::size_t>(n);
  }
  return last_id_;
}

bool StreamClient::is_answer(const nlohmann::json& line, Answer& answer) {
  if (!line.is_object() || !line.contains("jsonrpc")) return false;
  const auto id = line.find("id");
  answer.id = id != line.end() && id->is_number_integer() ? id->get<std::int64_t>() : 0;
  const auto error = line.find("error");
  answer.refused = error != line.end();
  if (answer.refused) {
    answer.message =
        error->is_object() && error->contains("message") && (*error)["message"].is_string()
            ? (*error)["message"].get<std::string>()
            : "the daemon refused without a reason";
  } else {
    answer.result = line.value("result", nlohmann::json());
  }
  return true;
}

Result<Answer> StreamClient::ask(const std::string& method, const nlohmann::json& params,
                                 const std::function<void(const std::string&)>& document) {
  const auto id = send(method, params);
  if (!id) return id.error();
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(kAnswerMs);
  for (;;) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    std::string line;
    const auto wait = next(static_cast<int>(std::max<std::int64_t>(0, left.count())), line);
    if (!wait) return wait.error();
    if (*wait == Wait::timeout) {
      return Error{ErrorKind::timeout,
                   fmt::format("no answer to {} within {} s; look at `systemctl "
                               "status shakerd`",
                               method, kAnswerMs / 1000)};
    }
    if (*wait == Wait::interrupted) continue;
    Answer answer;
    if (is_answer(nlohmann::json::parse(line, nullptr, false), answer) && answer.id == *id) {
      return answer;
    }
    if (document) document(line);
  }
}

}  // namespace shaker::cli
