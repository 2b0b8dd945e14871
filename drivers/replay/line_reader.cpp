#include "drivers/replay/line_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace shaker::drivers::replay {

Result<void> LineReader::open(const std::filesystem::path& file) {
  fd_ = UniqueFd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  begin_ = end_ = 0;
  at_end_ = false;
  trouble_.clear();
  if (fd_.valid()) return {};
  return Error{ErrorKind::invalid,
               fmt::format("cannot read the recording {}: {}; give a path relative to the "
                           "rig file",
                           file.string(), std::strerror(errno))};
}

// Moves the remaining bytes to the front and reads more. Returns false if there are no more.
bool LineReader::fill() {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  if (at_end_ || end_ == buffer_.size()) return false;
  ssize_t got = 0;
  do {
    got = ::read(fd_.get(), buffer_.data() + end_, buffer_.size() - end_);
  } while (got < 0 && errno == EINTR);
  if (got < 0) trouble_ = fmt::format("reading the recording failed: {}", std::strerror(errno));
  at_end_ = got <= 0;
  if (got > 0) end_ += static_cast<std::size_t>(got);
  return got > 0;
}

std::optional<std::string_view> LineReader::next() {
  for (;;) {
    const std::string_view there{buffer_.data() + begin_, end_ - begin_};
    const auto line_end = there.find('\n');
    if (line_end != std::string_view::npos) {
      begin_ += line_end + 1;
      return there.substr(0, line_end);
    }
    if (fill()) continue;
    const std::string_view rest{buffer_.data() + begin_, end_ - begin_};
    begin_ = end_;
    if (rest.empty()) return std::nullopt;
    return rest;
  }
}

}  // namespace shaker::drivers::replay
