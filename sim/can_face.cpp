#include "sim/can_face.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

namespace shaker::sim {
namespace {

constexpr double kAccelerationStep = 1e-5;  // m/s^2 per count
constexpr double kSetpointStep = 1e-3, kRampStep = 0.1;

can_frame frame(std::uint32_t id, std::uint8_t length) {
  can_frame made{};
  made.can_id = id;
  made.can_dlc = length;
  return made;
}

void put_intel(can_frame& f, int at, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i)
    f.data[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}
void put_motorola(can_frame& f, int at, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    f.data[at + i] = static_cast<std::uint8_t>(value >> (8 * (bytes - 1 - i)));
  }
}
std::uint32_t intel(const can_frame& f, int at, int bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i)
    value |= std::uint32_t{f.data[at + i]} << (8 * i);
  return value;
}

std::uint32_t counts(double value, double step, double most) {
  return static_cast<std::uint32_t>(std::lround(std::clamp(value / step, 0.0, most)));
}

Result<UniqueFd> bind_to(const std::string& interface) {
  const auto trouble = [&](const char* what) {
    return Error{ErrorKind::unavailable,
                 fmt::format("CAN interface {}: {}: {}", interface, what, std::strerror(errno))};
  };
  UniqueFd fd(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!fd.valid()) return trouble("the kernel offers no CAN sockets (modprobe can_raw vcan)");
  const unsigned index = if_nametoindex(interface.c_str());
  if (index == 0) return trouble("not there (ip link add dev NAME type vcan; ip link set NAME up)");
  const can_filter only_setpoints = {kSetpointId, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (setsockopt(fd.get(), SOL_CAN_RAW, CAN_RAW_FILTER, &only_setpoints, sizeof only_setpoints) ||
      bind(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address)) {
    return trouble("cannot be opened");
  }
  return fd;
}

}  // namespace

can_frame stroke_frame(const RigSample& sample) {
  can_frame f = frame(kStrokeId, 7);
  put_intel(f, 0, std::bit_cast<std::uint32_t>(static_cast<float>(sample.displacement)), 4);
  put_intel(f, 4, sample.counter & 0xffffu, 2);
  put_intel(f, 6, std::isfinite(sample.displacement) ? 0 : 1, 1);
  return f;
}

can_frame table_frame(const RigSample& sample) {
  can_frame f = frame(kTableId, 6);
  const auto count = static_cast<std::int32_t>(std::lround(sample.excitation / kAccelerationStep));
  put_motorola(f, 0, static_cast<std::uint32_t>(count), 4);
  put_motorola(f, 4, sample.counter & 0xffffu, 2);
  return f;
}

can_frame auxiliary_frame(const RigSample& sample, std::size_t pair) {
  can_frame f = frame(kAuxiliaryId + static_cast<std::uint32_t>(pair), 8);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto value = static_cast<float>(sample.auxiliary[2 * pair + i]);
    put_intel(f, 4 * static_cast<int>(i), std::bit_cast<std::uint32_t>(value), 4);
  }
  return f;
}

can_frame status_frame(const RigStatus& status) {
  can_frame f = frame(kStatusId, 8);
  put_intel(f, 0, (status.running ? 1u : 0u) | (status.ready ? 2u : 0u), 2);
  put_intel(f, 2, status.fault, 2);
  put_intel(f, 4, counts(status.frequency_hz, kSetpointStep, 65535), 2);
  put_intel(f, 6, counts(status.amplitude, kSetpointStep, 65535), 2);
  return f;
}

void obey(const can_frame& f, VirtualRig& rig) {
  if (f.can_id != kSetpointId || f.can_dlc != 8) return;
  const bool enable = (f.data[4] & 1u) != 0;
  if (!enable) rig.set_enable(false);
  rig.set_ramp(intel(f, 5, 1) * kRampStep);
  rig.heartbeat(intel(f, 6, 2));
  const bool taken = rig.set_frequency(intel(f, 0, 2) * kSetpointStep) &&
                     rig.set_amplitude(intel(f, 2, 2) * kSetpointStep);
  if (enable && taken) rig.set_enable(true);
}

Result<CanFace> CanFace::open(const std::string& interface) {
  auto socket = bind_to(interface);
  if (!socket) return socket.error();
  return CanFace(interface, std::move(*socket));
}

void CanFace::lose_link(Nanoseconds now) {
  socket_.reset();
  retry_at_ = now + std::chrono::seconds(1);
}

void CanFace::send(const can_frame& f, Nanoseconds now) {
  if (!socket_.valid() && now >= retry_at_) {
    retry_at_ = now + std::chrono::seconds(1);
    if (auto again = bind_to(interface_)) socket_ = std::move(*again);
  }
  if (!socket_.valid()) {
    ++lost_;
    return;
  }
  if (write(socket_.get(), &f, sizeof f) == sizeof f) return;
  ++lost_;
  // A full queue or a link that is down recovers by itself; an interface that is gone needs a
  // new socket.
  if (errno == ENODEV || errno == ENXIO) lose_link(now);
}

void CanFace::receive(VirtualRig& rig, Nanoseconds now) {
  can_frame f{};
  while (socket_.valid()) {
    const ssize_t got = read(socket_.get(), &f, sizeof f);
    if (got == sizeof f) {
      obey(f, rig);
      continue;
    }
    if (got < 0 && (errno == ENODEV || errno == ENXIO)) lose_link(now);
    return;
  }
}

}  // namespace shaker::sim
