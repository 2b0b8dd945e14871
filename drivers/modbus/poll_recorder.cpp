#include "drivers/modbus/poll_recorder.hpp"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "protocol/modbus/register_log.hpp"

namespace shaker::drivers::modbus {

Result<PollRecorder> PollRecorder::open(const std::filesystem::path& file,
                                        const std::filesystem::path& directory) {
  if (file.empty()) return PollRecorder("", File(nullptr, &std::fclose));
  const std::string name = (directory / file).string();
  File opened(std::fopen(name.c_str(), "ae"), &std::fclose);
  if (!opened) {
    return Error{
        ErrorKind::io,
        fmt::format("record_to: {} cannot be written: {}; name a file in a folder that this "
                    "user may write to",
                    name, std::strerror(errno))};
  }
  // Line buffering: the log of a killed daemon ends with a whole line.
  std::setvbuf(opened.get(), nullptr, _IOLBF, 4096);
  return PollRecorder(name, std::move(opened));
}

void PollRecorder::connected(Nanoseconds t) {
  write(t, t, "connected", nullptr);
}
void PollRecorder::poll(Nanoseconds asked, Nanoseconds received, const RegisterSet& registers) {
  write(asked, received, nullptr, &registers);
}
void PollRecorder::failed(Nanoseconds asked, Nanoseconds received) {
  write(asked, received, "error", nullptr);
}

void PollRecorder::write(Nanoseconds asked, Nanoseconds received, const char* word,
                         const RegisterSet* registers) {
  if (!file_) return;
  line_.clear();
  protocol::modbus::begin_register_line(line_, asked.count(), received.count());
  if (word != nullptr) line_.append(" ").append(word);
  for (std::size_t i = 0; registers != nullptr && i < registers->blocks().size(); ++i)
    protocol::modbus::add_block(line_, registers->blocks()[i], registers->buffer(i));
  line_ += '\n';
  if (std::fwrite(line_.data(), 1, line_.size(), file_.get()) == line_.size()) return;
  trouble_ =
      fmt::format("{}: {}; recording has ended, measuring goes on", name_, std::strerror(errno));
  file_.reset();
}

}  // namespace shaker::drivers::modbus
