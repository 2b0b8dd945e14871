#include "drivers/replay/register_source.hpp"

#include "drivers/modbus/poll_decoder.hpp"
#include "drivers/replay/line_reader.hpp"
#include "protocol/modbus/register_log.hpp"

namespace shaker::drivers::replay {
namespace {

using protocol::modbus::RegisterLogLine;

class RegisterSource final : public Source {
 public:
  RegisterSource(std::filesystem::path file, modbus::PollDecoder decoder)
      : file_(std::move(file)), decoder_(std::move(decoder)) {}

  std::vector<protocol::Channel> channels() const override { return decoder_.channels(); }
  std::size_t most_samples() const override { return decoder_.channels().size(); }
  const SensorHealth& health() const override { return health_; }

  Result<void> rewind() override {
    if (auto opened = lines_.open(file_); !opened) return opened;
    health_ = {};
    health_.link_up = true;
    connections_ = 0;
    decoder_.restart();
    return {};
  }

  std::size_t next(std::span<Sample> out) override {
    while (const auto line = lines_.next()) {
      if (line->find_first_not_of(" \t\r") == std::string_view::npos) continue;
      const auto entry = protocol::modbus::parse_register_line(*line);
      if (!entry) {
        ++health_.malformed;
      } else if (const std::size_t count = take(*entry, out); count > 0) {
        return count;
      }
    }
    if (!lines_.trouble().empty()) {
      health_.link_up = false;
      health_.trouble = lines_.trouble();
    }
    return 0;
  }

 private:
  std::size_t take(const RegisterLogLine& entry, std::span<Sample> out) {
    switch (entry.kind) {
      case RegisterLogLine::Kind::connected:
        decoder_.restart();
        health_.reconnects = connections_++;
        return 0;
      case RegisterLogLine::Kind::error:
        ++health_.errors;
        return 0;
      case RegisterLogLine::Kind::poll:
        break;
    }
    auto& registers = decoder_.registers();
    auto blocks = entry.blocks;
    for (std::size_t i = 0; i < registers.blocks().size(); ++i) {
      if (take_block(blocks, registers.blocks()[i], registers.buffer(i))) continue;
      ++health_.malformed;
      return 0;
    }
    const std::size_t count =
        decoder_.decode(Nanoseconds(entry.asked_ns), Nanoseconds(entry.received_ns), out);
    health_.samples += count;
    return count;
  }

  std::filesystem::path file_;
  modbus::PollDecoder decoder_;
  LineReader lines_;
  SensorHealth health_;
  std::uint64_t connections_ = 0;
};

}  // namespace

Result<std::unique_ptr<Source>> open_register_log(const config::ReplaySensor& config,
                                                  const std::filesystem::path& directory) {
  auto decoder = modbus::PollDecoder::make(config.registers, config.timestamp);
  if (!decoder) return decoder.error();
  return std::unique_ptr<Source>(
      std::make_unique<RegisterSource>(directory / config.file, std::move(*decoder)));
}

}  // namespace shaker::drivers::replay
