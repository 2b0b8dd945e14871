// One connection to shakerd: documents come in as lines, requests go out on the same stream
// (docs/protocol.md).
//
// For one thread. Reading blocks, with a time limit. An Error is a sentence for the operator:
// there is no daemon, there is no permission, or the protocols differ.
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
  // Connects and reads the first line. ErrorKind: unavailable (no daemon), refused (no
  // permission, another protocol), exhausted (no free place), timeout, invalid (path of the
  // socket).
  static Result<StreamClient> connect(const std::filesystem::path& socket);

  const nlohmann::json& version() const { return version_; }
  const std::string& version_line() const { return version_line_; }

  // For polling. Lines may be waiting in the buffer: call next() first.
  int fd() const { return fd_.get(); }

  enum class Wait { line, timeout, interrupted };
  // Waits up to `timeout_ms` (-1: no limit) for the next line, a document or an answer.
  // `interrupted`: a signal came. Returns an Error when the connection is lost or a line is too
  // long.
  Result<Wait> next(int timeout_ms, std::string& line);

  // Sends a request and returns its id. Does not wait for the answer.
  Result<std::int64_t> send(const std::string& method, const nlohmann::json& params = nullptr);

  // Sends a request and waits up to 10 s for its answer; passes other lines to `document`.
  Result<Answer> ask(const std::string& method, const nlohmann::json& params = nullptr,
                     const std::function<void(const std::string&)>& document = {});

  // Returns true and fills `answer` when `line` is an answer; false when it is a document or
  // not JSON.
  static bool is_answer(const nlohmann::json& line, Answer& answer);

 private:
  explicit StreamClient(UniqueFd fd) : fd_(std::move(fd)) {}
  Result<void> greet(const std::string& socket);

  UniqueFd fd_;
  std::string buffer_;
  std::size_t searched_ = 0;  // the buffer has no line break before this position
  std::int64_t last_id_ = 0;
  nlohmann::json version_;
  std::string version_line_;
};

}  // namespace shaker::cli
