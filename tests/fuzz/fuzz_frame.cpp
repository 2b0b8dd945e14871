// Any frames in any order, for the CAN sensor's receiver and the exciter's codec, and any
// signal in any frame. Each frame of the input has flags, length, four bytes of identifier, and
// data.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "drivers/can/exciter_codec.hpp"
#include "drivers/can/receiver.hpp"
#include "tests/fuzz/target.hpp"

namespace can = shaker::protocol::can;
namespace drivers = shaker::drivers;
using shaker::Nanoseconds;
using shaker::protocol::Channel;

namespace {

struct Rig {
  can::Database database;
  drivers::can::FrameDecoder decoder;
  drivers::can::ExciterCodec codec;
};

const Rig& rig() {
  static const Rig loaded = [] {
    std::ifstream file(SHAKER_TEST_DATA "/can/rig.dbc", std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    auto database = can::parse_dbc(text, "rig.dbc");
    const shaker::config::CanSignal signals[] = {
        {Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0},
        {Channel::displacement, "transducer_tpdo1", "sensor_status", 1.0, 0.0},
        {Channel::excitation, "accelerometer", "table", 1.0, 0.0},
        {Channel::acceleration, "accelerometer", "mass", 1.0, 0.0},
        {Channel::displacement, "wide", "last", 1.0, 0.0},
        {Channel::force, "load_cell", "force", 1.0, 0.0}};
    auto decoder = drivers::can::FrameDecoder::make(database.value(), signals);
    shaker::config::CanExciter exciter;
    exciter.setpoint_message = "exciter_setpoint";
    exciter.status_message = "exciter_status";
    auto codec = drivers::can::ExciterCodec::make(*database, exciter);
    return Rig{std::move(*database), std::move(decoder.value()), std::move(codec.value())};
  }();
  return loaded;
}

// Reads a signal at any position from the frame; written back, it must give the same value.
void try_signal(const can::Frame& frame) {
  can::Signal signal;
  signal.start_bit = static_cast<int>(frame.id % 520);
  signal.length = static_cast<int>(1 + (frame.id >> 10) % 64);
  signal.order = (frame.id & 0x10000) != 0 ? can::ByteOrder::intel : can::ByteOrder::motorola;
  signal.format = (frame.id & 0x20000) != 0 ? can::NumberFormat::signed_integer
                                            : can::NumberFormat::unsigned_integer;
  if (signal.length == 32 && (frame.id & 0x40000) != 0) signal.format = can::NumberFormat::float32;
  if (signal.length == 64 && (frame.id & 0x40000) != 0) signal.format = can::NumberFormat::float64;
  const auto value = can::decode(signal, frame.bytes());
  if (value.has_value() != (can::bytes_needed(signal) <= frame.length)) std::abort();
  if (!value || !std::isfinite(*value)) return;
  if (signal.length > 53 && signal.format != can::NumberFormat::float64) return;
  auto copy = frame.data;
  const auto written = can::encode(signal, *value, std::span(copy).first(frame.length));
  if (!written || can::decode(signal, std::span(copy).first(frame.length)) != *value) std::abort();
  if (*value != 0.0 && copy != frame.data) std::abort();  // no other bit, except for -0.0
}

can::Frame take_frame(const std::uint8_t*& data, std::size_t& size) {
  can::Frame frame;
  const std::uint8_t flags = data[0];
  frame.fd = (flags & 1) != 0;
  frame.extended = (flags & 2) != 0;
  frame.remote = (flags & 4) != 0;
  frame.error = (flags & 8) != 0;
  const std::size_t most = frame.fd ? can::kMaxLength : can::kMaxClassicLength;
  frame.length = static_cast<std::uint8_t>(std::min<std::size_t>(data[1], most));
  std::memcpy(&frame.id, data + 2, 4);
  frame.id &= can::kExtendedMask;
  const std::size_t there = std::min<std::size_t>(frame.length, size - 6);
  std::memcpy(frame.data.data(), data + 6, there);
  data += 6 + there;
  size -= 6 + there;
  return frame;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  drivers::can::Receiver receiver(rig().decoder, "can0", shaker::config::CanOpen{1, true, 0.01});
  std::array<drivers::Sample, 8> samples;
  drivers::can::Block block{samples, 0};
  Nanoseconds now{};
  while (size >= 6) {
    const can::Frame frame = take_frame(data, size);
    now += std::chrono::milliseconds(7);
    if (block.room() < rig().decoder.most_samples()) block.count = 0;
    receiver.take(frame, now, block);
    if (block.count > samples.size()) std::abort();
    for (can::Frame out; receiver.canopen()->next_to_send(now, out);) {
      if (out.length > can::kMaxClassicLength) std::abort();
    }
    if (rig().codec.is_status(frame)) (void)rig().codec.status(frame, now);
    try_signal(frame);
  }
  return 0;
}
