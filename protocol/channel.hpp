// What a measured number is about.
#pragma once

#include <optional>
#include <string_view>

namespace shaker::protocol {

// The quantities of the rig. Signs: stroke > 0 in compression; excitation is the upward
// acceleration of the table. Units are SI throughout: m, m/s^2, N.
enum class Channel : unsigned char {
  displacement,  // stroke u of the damper, m
  excitation,    // acceleration x of the table, m/s^2
  acceleration,  // acceleration of the sprung mass, m/s^2 (optional)
  force          // load cell, N (optional)
};
inline constexpr int kChannelCount = 4;

constexpr std::string_view name(Channel channel) {
  constexpr std::string_view names[] = {"displacement", "excitation", "acceleration", "force"};
  return names[static_cast<int>(channel)];
}
constexpr std::string_view unit(Channel channel) {
  constexpr std::string_view units[] = {"m", "m/s^2", "m/s^2", "N"};
  return units[static_cast<int>(channel)];
}
constexpr std::optional<Channel> channel_from_name(std::string_view text) {
  for (int i = 0; i < kChannelCount; ++i) {
    if (name(static_cast<Channel>(i)) == text) return static_cast<Channel>(i);
  }
  return std::nullopt;
}

}  // namespace shaker::protocol
