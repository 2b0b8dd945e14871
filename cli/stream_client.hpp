// One connection to shakerd: documents come in as lines, requests go out on the same stream.
//
// Blocking with time limits, one thread. Errors are sentences for the operator: whether there is no
// daemon, no permission, or a protocol that this program does not speak. Protocol:
// docs/protocol.md.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <string>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::cli {

inline constexpr int kProtocol = 1;
inline constexpr std::size_t kMaxLine = 1024 * 1024;

// The daemon's answer to a request.
struct Answer {
  std::int64_t id = 0;
  bool refused = false;
  std::string message;    // when refused
  nlohmann::json result;  // otherwise
};

class StreamClient {
 public:
  // Connects and reads the first line. ErrorKind: unavailable (no daemon), refused (no permission,
  // another protocol), exhausted (no place free), timeout.
  static Result<StreamClient> connect(const std::filesystem::path& socket);

  const nlohmann::json& version() const { return version_; }
  const std::string& version_line() const { return version_line_; }

  // To wait on together with others. Lines may be waiting in the buffer: ask next() first.
  int fd() const { return fd_.get(); }

  enum class Wait { line, timeout, interrupted };
  // The next line within `timeout_ms` (-1: no limit): a document or an answer. `interrupted`: a
  // signal came. An Error: the daemon is gone.
  Result<Wait> next(int timeout_ms, std::string& line);

  // Sends and returns at once; gives the request's id.
  Result<std::int64_t> send(const std::string& method, const nlohmann::json& params = nullptr);

  // Sends and waits for the answer (10 s); what comes in between goes to `document`.
  Result<Answer> ask(const std::string& method, const nlohmann::json& params = nullptr,
                     const std::function<void(const std::string&)>& document = {});

  // The answer in a line; nothing for a document. Null json when the line is not JSON.
  static bool is_answer(const nlohmann::json& line, Answer& answer);

 private:
  explicit StreamClient(UniqueFd fd) : fd_(std::move(fd)) {}
  Result<void> greet(const std::string& socket);

  UniqueFd fd_;
  std::string buffer_;
  std::size_t searched_ = 0;  // of the buffer: no line break before
  std::int64_t last_id_ = 0;
  nlohmann::json version_;
  std::string version_line_;
};

}  // namespace shaker::cli
