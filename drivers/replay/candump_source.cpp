#include "drivers/replay/candump_source.hpp"

#include <fmt/format.h>

#include "drivers/can/dbc_file.hpp"
#include "drivers/can/frame_decoder.hpp"
#include "drivers/can/receiver.hpp"
#include "drivers/replay/line_reader.hpp"
#include "protocol/can/candump_log.hpp"

namespace shaker::drivers::replay {
namespace {

class CandumpSource final : public Source {
 public:
  CandumpSource(std::filesystem::path file, can::FrameDecoder decoder)
      : file_(std::move(file)),
        decoder_(std::move(decoder)),
        receiver_(decoder_, "log", std::nullopt) {}

  std::vector<protocol::Channel> channels() const override { return decoder_.channels(); }
  std::size_t most_samples() const override { return decoder_.most_samples(); }
  const SensorHealth& health() const override { return receiver_.health(); }

  Result<void> rewind() override {
    if (auto opened = lines_.open(file_); !opened) return opened;
    receiver_ = can::Receiver(decoder_, "log", std::nullopt);
    receiver_.connected(Nanoseconds{0});
    return {};
  }

  std::size_t next(std::span<Sample> out) override {
    can::Block block{out, 0};
    while (block.count == 0) {
      const auto line = lines_.next();
      if (!line) break;
      if (line->find_first_not_of(" \t\r") == std::string_view::npos) continue;
      const auto entry = protocol::can::parse_log_line(*line);
      if (entry) {
        receiver_.take(entry->frame, Nanoseconds(entry->t_ns), block);
      } else {
        receiver_.count_malformed();
      }
    }
    if (block.count == 0 && !lines_.trouble().empty()) receiver_.disconnected(lines_.trouble());
    return block.count;
  }

 private:
  std::filesystem::path file_;
  can::FrameDecoder decoder_;
  can::Receiver receiver_;
  LineReader lines_;
};

}  // namespace

Result<std::unique_ptr<Source>> open_candump(const config::ReplaySensor& config,
                                             const std::filesystem::path& directory) {
  const auto file = directory / config.file;
  if (config.dbc.empty()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{} is no campaign database; a candump log needs \"dbc\" and "
                             "\"signals\" to be replayed",
                             file.string())};
  }
  auto database = can::load_dbc(directory / config.dbc);
  if (!database) return database.error();
  auto decoder = can::FrameDecoder::make(std::move(*database), config.signals);
  if (!decoder) return decoder.error();
  return std::unique_ptr<Source>(std::make_unique<CandumpSource>(file, std::move(*decoder)));
}

}  // namespace shaker::drivers::replay
