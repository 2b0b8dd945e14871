// One CAN frame as on the wire, classic (up to 8 bytes) or FD (up to 64).
//
// Plain data, independent of the kernel's headers, so that codecs, recorded logs and drivers
// share it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace shaker::protocol::can {

inline constexpr std::size_t kMaxClassicLength = 8;
inline constexpr std::size_t kMaxLength = 64;
inline constexpr std::uint32_t kStandardMask = 0x7FF;
inline constexpr std::uint32_t kExtendedMask = 0x1FFFFFFF;

struct Frame {
  std::uint32_t id = 0;     // 11 or 29 bits; for an error frame its class bits
  std::uint8_t length = 0;  // bytes in use, <= kMaxLength
  bool extended = false;
  bool fd = false;
  bool remote = false;
  bool error = false;  // made by the adapter's driver, not by a node: see error_frame.hpp
  std::array<std::uint8_t, kMaxLength> data{};

  std::span<const std::uint8_t> bytes() const { return {data.data(), length}; }
};

}  // namespace shaker::protocol::can
