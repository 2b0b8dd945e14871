#include "sim/register_map.hpp"

#include <bit>

namespace shaker::sim {
namespace {

using Words = std::span<const std::uint16_t>;

void put_u32(std::span<std::uint16_t> registers, int at, std::uint32_t value) {
  registers[static_cast<std::size_t>(at)] = static_cast<std::uint16_t>(value >> 16);
  registers[static_cast<std::size_t>(at) + 1] = static_cast<std::uint16_t>(value);
}
void put_f32(std::span<std::uint16_t> registers, int at, double value) {
  put_u32(registers, at, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

// One writable value: its address, its number of words, the check of its range and its action.
struct Item {
  int address, words;
  bool (*acceptable)(double value);
  bool (*apply)(VirtualRig& rig, double value);
};

template <int highest>
bool up_to(double value) {
  return value >= 0.0 && value <= highest;
}
std::uint32_t whole(double value) {
  return static_cast<std::uint32_t>(value);
}

constexpr Item kItems[] = {
    {Holding::frequency, 2, up_to<static_cast<int>(kHighestFrequency)>,
     [](VirtualRig& rig, double v) { return rig.set_frequency(v); }},
    {Holding::amplitude, 2, up_to<static_cast<int>(kHighestAmplitude)>,
     [](VirtualRig& rig, double v) { return rig.set_amplitude(v); }},
    {Holding::ramp, 2, up_to<static_cast<int>(kLongestRamp)>,
     [](VirtualRig& rig, double v) { return rig.set_ramp(v); }},
    {Holding::heartbeat, 1, up_to<65535>,
     [](VirtualRig& rig, double v) {
       rig.heartbeat(whole(v));
       return true;
     }},
    {Holding::heartbeat_timeout, 2, up_to<static_cast<int>(kLongestHeartbeatTimeout)>,
     [](VirtualRig& rig, double v) { return rig.set_heartbeat_timeout(v); }},
    {Holding::fault_reset, 1, up_to<1>,
     [](VirtualRig& rig, double v) {
       if (v == 1.0) rig.clear_fault();
       return true;
     }},
    {Holding::inject, 1, up_to<kFaultCount - 1>,
     [](VirtualRig& rig, double v) {
       rig.inject(static_cast<Fault>(whole(v)));
       return true;
     }},
    {Holding::enable, 1, up_to<1>,
     [](VirtualRig& rig, double v) { return rig.set_enable(v == 1.0); }}};

double value_of(const Item& item, int address, Words words) {
  const auto at = static_cast<std::size_t>(item.address - address);
  if (item.words == 1) return words[at];
  const auto bits = std::uint32_t{words[at]} << 16 | words[at + 1];
  return static_cast<double>(std::bit_cast<float>(bits));
}

}  // namespace

Refusal RegisterMap::write(int address, Words words) {
  const int end = address + static_cast<int>(words.size());
  if (address < 0 || words.empty() || end > Holding::count) return Refusal::illegal_address;
  const auto touched = [&](const Item& item) {
    return item.address < end && address < item.address + item.words;
  };
  for (const Item& item : kItems) {
    if (!touched(item)) continue;
    if (item.address < address || item.address + item.words > end) return Refusal::illegal_address;
    if (!item.acceptable(value_of(item, address, words))) return Refusal::illegal_value;
  }
  // Disabling comes first and enabling last.
  for (const Item& item : kItems) {
    if (item.address == Holding::enable && touched(item) && value_of(item, address, words) == 0.0) {
      item.apply(rig_, 0.0);
    }
  }
  for (const Item& item : kItems) {
    if (!touched(item)) continue;
    if (!item.apply(rig_, value_of(item, address, words))) return Refusal::device_failure;
  }
  return Refusal::none;
}

std::array<std::uint16_t, Holding::count> RegisterMap::holding() const {
  const RigSettings settings = rig_.settings();
  std::array<std::uint16_t, Holding::count> r{};
  put_f32(r, Holding::frequency, settings.frequency_hz);
  put_f32(r, Holding::amplitude, settings.amplitude);
  r[Holding::enable] = settings.enable ? 1 : 0;
  put_f32(r, Holding::ramp, settings.ramp_s);
  r[Holding::heartbeat] = static_cast<std::uint16_t>(settings.heartbeat);
  put_f32(r, Holding::heartbeat_timeout, settings.heartbeat_timeout_s);
  r[Holding::inject] = static_cast<std::uint16_t>(rig_.injected());
  return r;
}

std::array<std::uint16_t, Input::count> RegisterMap::input() const {
  const RigStatus status = rig_.status();
  std::array<std::uint16_t, Input::count> r{};
  r[Input::status] = static_cast<std::uint16_t>((status.running ? 1 : 0) | (status.ready ? 2 : 0));
  r[Input::fault] = static_cast<std::uint16_t>(status.fault);
  put_f32(r, Input::frequency_actual, status.frequency_hz);
  put_f32(r, Input::amplitude_actual, status.amplitude);
  put_f32(r, Input::displacement, newest_.displacement);
  put_f32(r, Input::excitation, newest_.excitation);
  put_u32(r, Input::stamp_us, newest_.device_us);
  put_u32(r, Input::counter, newest_.counter);
  for (std::size_t i = 0; i < kAuxiliaryMost; ++i)
    put_f32(r, Input::auxiliary + 2 * static_cast<int>(i), newest_.auxiliary[i]);
  return r;
}

}  // namespace shaker::sim
