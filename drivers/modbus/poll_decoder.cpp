#include "drivers/modbus/poll_decoder.hpp"

#include <cmath>

#include <fmt/format.h>

namespace shaker::drivers::modbus {
namespace {

using protocol::Channel;
using protocol::modbus::RegisterSpec;
using protocol::modbus::RegisterType;

Error wrong(const std::string& text) {
  return Error{ErrorKind::invalid, text};
}

// Our own clock distinguishes wraps from missed polls; a longer range makes this certain.
constexpr double kShortestRangeNs = 2e9;

Result<DeviceClock> make_device_clock(const RegisterSpec& spec) {
  if (const Result<void> good = protocol::modbus::validate(spec); !good) {
    return wrong(fmt::format("registers.timestamp: {}", good.error().what));
  }
  if (spec.type != RegisterType::u16 && spec.type != RegisterType::u32) {
    return wrong("registers.timestamp: the type must be u16 or u32");
  }
  const double unit_ns = spec.unit == "us"   ? 1e3
                         : spec.unit == "ms" ? 1e6
                         : spec.unit == "s"  ? 1e9
                                             : 0.0;
  if (unit_ns == 0.0 || spec.scale < 0.0) {
    return wrong(
        fmt::format("registers.timestamp: unit \"{}\" must be us, ms or s, scale {} above 0",
                    spec.unit, spec.scale));
  }
  const DeviceClock::Counter counter{16 * protocol::modbus::word_count(spec.type),
                                     unit_ns * spec.scale};
  const double range_ns = std::ldexp(counter.tick_ns, counter.bits);
  if (range_ns < kShortestRangeNs) {
    return wrong(
        fmt::format("registers.timestamp: it wraps every {:.3g} s, at least {:g} s are "
                    "needed to tell a wrap from missed polls; leave it out",
                    range_ns * 1e-9, kShortestRangeNs * 1e-9));
  }
  return DeviceClock(counter);
}

}  // namespace

Result<PollDecoder> PollDecoder::make(const std::map<Channel, RegisterSpec>& registers,
                                      const std::optional<RegisterSpec>& timestamp) {
  if (registers.empty()) return wrong("registers: at least one channel is needed");
  std::vector<Channel> channels;
  std::vector<RegisterSpec> specs;
  for (const auto& [channel, spec] : registers) {
    if (const Result<void> good = protocol::modbus::validate(spec); !good) {
      return wrong(fmt::format("registers.{}: {}", protocol::name(channel), good.error().what));
    }
    channels.push_back(channel);
    specs.push_back(spec);
  }
  std::optional<DeviceClock> device_clock;
  if (timestamp) {
    const Result<DeviceClock> made = make_device_clock(*timestamp);
    if (!made) return made.error();
    device_clock = *made;
    specs.push_back(*timestamp);
    if (protocol::modbus::plan_reads(specs).blocks.size() != 1) {
      return wrong(
          "registers.timestamp: it is not read in one request with all channels, so it could be of "
          "another sample; take registers without a hole between them, or leave it out");
    }
  }
  return PollDecoder(std::move(channels), std::move(specs), device_clock);
}

void PollDecoder::restart() {
  if (device_clock_) device_clock_->restart();
}

std::size_t PollDecoder::decode(Nanoseconds asked, Nanoseconds received, std::span<Sample> out) {
  Nanoseconds taken = asked + (received - asked) / 2;
  if (device_clock_) {
    const auto stamp = device_clock_->stamp(registers_.bits(channels_.size()), asked, received);
    if (!stamp) return 0;
    taken = *stamp;
  }
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const double value = registers_.value(i);
    out[i] = {taken, value, channels_[i], std::isfinite(value) ? Quality::good : Quality::bad};
  }
  return channels_.size();
}

}  // namespace shaker::drivers::modbus
