// The quantities that a rig measures.
#pragma once

#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace shaker::protocol {

// The quantities of the rig. Signs: stroke > 0 in compression; excitation is the upward
// acceleration of the table. Units are SI throughout: m, m/s^2, N.
enum class Channel : unsigned char {
  displacement,  // stroke u of the damper, m
  excitation,    // acceleration x of the table, m/s^2
  acceleration,  // acceleration of the sprung mass, m/s^2 (optional)
  force,         // load cell, N (optional)
  // Other quantities of the rig: recorded, exported and shown, but not used for estimates. The
  // rig file gives each a name and a unit (ChannelLabel).
  aux1,
  aux2,
  aux3,
  aux4,
  aux5,
  aux6,
  aux7,
  aux8
};
inline constexpr int kAuxiliaryCount = 8;
inline constexpr int kChannelCount = 4 + kAuxiliaryCount;

constexpr Channel auxiliary(int index) {  // from 0
  return static_cast<Channel>(static_cast<int>(Channel::aux1) + index);
}
constexpr bool is_auxiliary(Channel channel) {
  return channel >= Channel::aux1;
}

constexpr std::string_view name(Channel channel) {
  constexpr std::string_view names[] = {"displacement", "excitation", "acceleration", "force",
                                        "aux1",         "aux2",       "aux3",         "aux4",
                                        "aux5",         "aux6",       "aux7",         "aux8"};
  static_assert(std::size(names) == kChannelCount);
  return names[static_cast<int>(channel)];
}
// SI unit of a channel; empty for an auxiliary channel, whose unit is in the rig file.
constexpr std::string_view unit(Channel channel) {
  constexpr std::string_view units[kChannelCount] = {"m", "m/s^2", "m/s^2", "N"};
  return units[static_cast<int>(channel)];
}
constexpr std::optional<Channel> channel_from_name(std::string_view text) {
  for (int i = 0; i < kChannelCount; ++i) {
    if (name(static_cast<Channel>(i)) == text) return static_cast<Channel>(i);
  }
  return std::nullopt;
}

// Name and unit of an auxiliary channel in this laboratory.
struct ChannelLabel {
  std::string name, unit;
};
using ChannelLabels = std::map<Channel, ChannelLabel>;

// Name and unit to show: those of the label, if there is one.
inline ChannelLabel label(Channel channel, const ChannelLabels& labels) {
  const auto found = labels.find(channel);
  if (found != labels.end()) return found->second;
  return {std::string(name(channel)), std::string(unit(channel))};
}

}  // namespace shaker::protocol
