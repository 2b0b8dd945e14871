#include "drivers/modbus/exciter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/modbus/connection.hpp"
#include "drivers/modbus/register_set.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::modbus::RegisterSpec;
using protocol::modbus::RegisterType;

// The setpoint's registers; the value is the index into the arrays below.
enum Role : std::size_t { kFrequency, kAmplitude, kRamp, kEnable };
constexpr std::array<const char*, 4> kSetpointRoles = {"frequency", "amplitude", "ramp", "enable"};
// The registers that are read as status; the first two are required.
constexpr std::array<const char*, 5> kStatusRoles = {"status", "fault", "frequency_actual",
                                                     "amplitude_actual", "heartbeat_timeout"};

// A drive may need a cycle of its program before a written register reads back.
constexpr Nanoseconds kReadBackPause = 3ms;

struct Words {
  std::array<std::uint16_t, 2> data{};
  std::size_t count = 1;
  std::span<const std::uint16_t> span() const { return std::span(data).first(count); }
  bool operator==(const Words&) const = default;
};

using SetpointWords = std::array<Words, kSetpointRoles.size()>;
using Values = std::array<double, kSetpointRoles.size()>;
using Roles = std::vector<std::size_t>;

Result<Words> encode(const RegisterSpec& spec, double value) {
  Words words;
  words.count = static_cast<std::size_t>(protocol::modbus::word_count(spec.type));
  const Result<void> done =
      protocol::modbus::encode(spec, value, std::span(words.data).first(words.count));
  if (!done) return done.error();
  return words;
}

class ModbusExciter final : public Exciter {
 public:
  ModbusExciter(const config::ModbusExciter& config, Clock& clock,
                std::unique_ptr<ModbusConnection> connection, std::vector<RegisterSpec> setpoint,
                std::vector<RegisterSpec> status, std::vector<std::size_t> status_roles)
      : config_(config),
        clock_(clock),
        connection_(std::move(connection)),
        setpoint_(std::move(setpoint)),
        status_(std::move(status)),
        status_roles_(std::move(status_roles)),
        heartbeat_(config.registers.at("heartbeat")) {}

  std::string description() const override { return connection_->description(); }
  Result<void> connect() override { return connection_->connect(); }
  Result<void> write(const Setpoint& setpoint) override;
  Result<ExciterStatus> read() override;
  Result<void> clear_fault() override;
  Result<void> heartbeat() override;
  Result<void> stop() override;

 private:
  Result<SetpointWords> encode_all(const Values& values) const;
  Result<void> learn_what_it_holds();
  Result<void> send(const Roles& roles, const SetpointWords& wanted);
  Result<void> confirm(const Roles& roles, const SetpointWords& wanted);
  Result<void> zero();

  const config::ModbusExciter config_;
  Clock& clock_;
  std::unique_ptr<ModbusConnection> connection_;
  RegisterSet setpoint_;
  RegisterSet status_;
  std::vector<std::size_t> status_roles_;  // for each register in status_, index into kStatusRoles
  RegisterSpec heartbeat_;
  int count_ = 0;
  // Known contents of the device; empty after a reconnect and during a write.
  std::array<std::optional<Words>, kSetpointRoles.size()> held_;
  std::uint64_t held_since_connect_ = 0;
};

Result<SetpointWords> ModbusExciter::encode_all(const Values& values) const {
  SetpointWords all;
  for (std::size_t role = 0; role < all.size(); ++role) {
    const Result<Words> words = encode(setpoint_.spec(role), values[role]);
    if (!words) {
      return Error{ErrorKind::invalid, fmt::format("{}: {}: {}", description(),
                                                   kSetpointRoles[role], words.error().what)};
    }
    all[role] = *words;
  }
  return all;
}

Result<void> ModbusExciter::learn_what_it_holds() {
  if (held_since_connect_ != connection_->counters().connects) held_.fill(std::nullopt);
  held_since_connect_ = connection_->counters().connects;
  if (std::all_of(held_.begin(), held_.end(), [](const auto& h) { return h.has_value(); })) {
    return {};
  }
  if (Result<void> done = setpoint_.read(*connection_); !done) return done;
  for (std::size_t role = 0; role < held_.size(); ++role) {
    Words words;
    words.count = setpoint_.words(role).size();
    std::ranges::copy(setpoint_.words(role), words.data.begin());
    held_[role] = words;
  }
  return {};
}

Result<void> ModbusExciter::write(const Setpoint& setpoint) {
  const Result<SetpointWords> wanted = encode_all(
      {setpoint.frequency_hz, setpoint.amplitude, setpoint.ramp_s, setpoint.enable ? 1.0 : 0.0});
  if (!wanted) return wanted.error();
  if (Result<void> known = learn_what_it_holds(); !known) return known;

  Roles changed;
  for (std::size_t role = 0; role < held_.size(); ++role) {
    if (held_[role] != (*wanted)[role]) changed.push_back(role);
  }
  const bool switches = std::erase(changed, std::size_t{kEnable}) > 0;
  if (switches && !setpoint.enable) {
    if (Result<void> off = send({kEnable}, *wanted); !off) return off;
  }
  if (Result<void> sent = send(changed, *wanted); !sent) return sent;
  if (Result<void> good = confirm(changed, *wanted); !good) return good;
  if (!switches) return {};
  if (setpoint.enable) {
    if (Result<void> on = send({kEnable}, *wanted); !on) return on;
  }
  return confirm({kEnable}, *wanted);
}

// Neighbouring registers are written in one request, which the device takes as a whole.
Result<void> ModbusExciter::send(const Roles& roles, const SetpointWords& wanted) {
  std::vector<RegisterSpec> specs;
  for (const std::size_t role : roles)
    specs.push_back(setpoint_.spec(role));
  const Result<protocol::modbus::Plan> plan = protocol::modbus::plan_writes(specs);
  if (!plan) return plan.error();
  std::vector<std::vector<std::uint16_t>> blocks;
  for (const auto& block : plan->blocks)
    blocks.emplace_back(static_cast<std::size_t>(block.words));
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const protocol::modbus::Placement place = plan->placements[i];
    std::ranges::copy(wanted[roles[i]].span(),
                      blocks[static_cast<std::size_t>(place.block)].begin() + place.offset);
    held_[roles[i]].reset();
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (Result<void> sent = connection_->write(plan->blocks[i].address, blocks[i]); !sent) {
      return sent;
    }
  }
  return {};
}

Result<void> ModbusExciter::confirm(const Roles& roles, const SetpointWords& wanted) {
  if (roles.empty()) return {};
  const Nanoseconds deadline = clock_.now() + connection_->response_timeout();
  for (;;) {
    if (Result<void> done = setpoint_.read(*connection_); !done) return done;
    const auto wrong = std::ranges::find_if(roles, [&](std::size_t role) {
      const RegisterSpec& spec = setpoint_.spec(role);
      const double sent = protocol::modbus::decode(spec, wanted[role].span());
      // 0.75 of a step: a difference of one step is an error, whatever the rounding of the
      // scale.
      return !(std::abs(setpoint_.value(role) - sent) <
               0.75 * protocol::modbus::resolution(spec, sent));
    });
    if (wrong == roles.end()) break;
    if (clock_.now() + kReadBackPause >= deadline) {
      const RegisterSpec& spec = setpoint_.spec(*wrong);
      return Error{
          ErrorKind::refused,
          fmt::format("{}: {} was written as {:g} but reads back as {:g} {}; check the drive's own "
                      "limits, and the type, scale and word order of register {}",
                      description(), kSetpointRoles[*wrong],
                      protocol::modbus::decode(spec, wanted[*wrong].span()),
                      setpoint_.value(*wrong), spec.unit, spec.address)};
    }
    clock_.sleep_until(clock_.now() + kReadBackPause);
  }
  for (const std::size_t role : roles)
    held_[role] = wanted[role];
  return {};
}

Result<ExciterStatus> ModbusExciter::read() {
  if (Result<void> done = status_.read(*connection_); !done) return done.error();
  ExciterStatus status;
  status.t = clock_.now();
  const auto finite = [&](std::size_t i) {
    const double value = status_.value(i);
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
  };
  const std::uint32_t flags = status_.bits(0);
  status.fault = status_.bits(1);
  status.running = (flags & config_.status_running) != 0;
  status.ready = (flags & config_.status_ready) == config_.status_ready && status.fault == 0;
  for (std::size_t i = 2; i < status_.size(); ++i) {
    if (status_roles_[i] == 2) status.frequency_hz = finite(i);
    if (status_roles_[i] == 3) status.amplitude = finite(i);
    if (status_roles_[i] == 4) status.heartbeat_timeout_s = finite(i);
  }
  return status;
}

// Most controllers react to the rising edge, so 0 is written before 1; some clear the register
// themselves.
Result<void> ModbusExciter::clear_fault() {
  const Result<void> stopped = stop();
  const auto found = config_.registers.find("fault_reset");
  if (!stopped || found == config_.registers.end()) return stopped;
  for (const double value : {0.0, 1.0}) {
    const Result<Words> words = encode(found->second, value);
    if (!words) return words.error();
    const auto sent = connection_->write(found->second.address, words->span());
    if (!sent) return sent.error();
  }
  return {};
}

// Counts 1..32767, which every register type can hold; never 0, which a device may take for "no
// heartbeat yet".
Result<void> ModbusExciter::heartbeat() {
  count_ = count_ % 32767 + 1;
  const Result<Words> words = encode(heartbeat_, count_);
  if (!words) return words.error();
  return connection_->write(heartbeat_.address, words->span());
}

Result<void> ModbusExciter::stop() {
  held_.fill(std::nullopt);
  connection_->break_silence();
  if (connection_->connected() && zero()) return {};
  // The order or its answer may be lost: repeat it on a new connection.
  connection_->wait_for_silence();
  connection_->close();
  if (Result<void> connected = connection_->connect_now(); !connected) return connected;
  return zero();
}

Result<void> ModbusExciter::zero() {
  const Result<SetpointWords> zeros = encode_all({0.0, 0.0, 0.0, 0.0});
  if (!zeros) return zeros.error();
  // Send both orders, whatever the result of the first: either of them stops the motion.
  const Result<void> off = send({kEnable}, *zeros);
  connection_->break_silence();
  const Result<void> flat = send({kAmplitude}, *zeros);
  if (!off) return off;
  if (!flat) return flat;
  connection_->wait_for_silence();
  return confirm({kEnable, kAmplitude}, *zeros);
}

// --- checks of the rig file

Error wrong(const std::string& role, const std::string& text) {
  return Error{ErrorKind::invalid, "registers." + role + ": " + text};
}

template <std::size_t n>
bool contains(const std::array<const char*, n>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

Result<void> check_role(const std::string& role, const RegisterSpec& spec) {
  const bool written =
      contains(kSetpointRoles, role) || role == "heartbeat" || role == "fault_reset";
  if (!written && !contains(kStatusRoles, role)) {
    return wrong(role,
                 "no such role; allowed are frequency, amplitude, enable, ramp, heartbeat, status, "
                 "fault, frequency_actual, amplitude_actual, heartbeat_timeout, fault_reset");
  }
  if (Result<void> good = protocol::modbus::validate(spec); !good) {
    return wrong(role, good.error().what);
  }
  if (written && spec.table != protocol::modbus::RegisterTable::holding) {
    return wrong(role, "is written, so it must be a holding register");
  }
  if ((role == "status" || role == "fault") && spec.type == RegisterType::f32) {
    return wrong(role, "is a set of bits or a code, so its type must be u16, i16, u32 or i32");
  }
  return {};
}

// Checks that the register can hold the values that the driver writes, above all zero.
Result<void> check_range(const std::string& role, const RegisterSpec& spec, double low,
                         double high) {
  for (const double value : {low, high}) {
    if (const Result<Words> words = encode(spec, value); !words) {
      return wrong(role, words.error().what);
    }
  }
  return {};
}

Result<void> check(const config::ModbusExciter& config) {
  const auto& registers = config.registers;
  for (const char* role :
       {"frequency", "amplitude", "enable", "ramp", "heartbeat", "status", "fault"}) {
    if (!registers.contains(role)) return wrong(role, "is missing; every exciter needs it");
  }
  std::vector<RegisterSpec> written;
  for (const auto& [role, spec] : registers) {
    if (Result<void> good = check_role(role, spec); !good) return good;
    if (contains(kSetpointRoles, role) || role == "heartbeat" || role == "fault_reset") {
      written.push_back(spec);
    }
  }
  if (const auto plan = protocol::modbus::plan_writes(written); !plan) {
    return Error{ErrorKind::invalid, "registers: " + plan.error().what};
  }
  if (!registers.at("heartbeat").cyclic) {
    return wrong("heartbeat",
                 "is written for ever, so it must be marked \"cyclic\": true; check first in the "
                 "drive's manual that it is not kept in EEPROM (10 000 writes)");
  }
  for (const auto& [role, high] :
       {std::pair{"amplitude", 0.0}, std::pair{"frequency", 0.0}, std::pair{"ramp", 0.0},
        std::pair{"enable", 1.0}, std::pair{"heartbeat", 32767.0}, std::pair{"fault_reset", 1.0}}) {
    const auto found = registers.find(role);
    if (found == registers.end()) continue;
    if (Result<void> good = check_range(role, found->second, 0.0, high); !good) return good;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Exciter>> make_exciter(const config::ModbusExciter& config, Clock& clock) {
  if (const Result<void> good = check(config); !good) return good.error();
  auto connection = ModbusConnection::make(config.link, clock);
  if (!connection) return connection.error();
  std::vector<RegisterSpec> setpoint, status;
  std::vector<std::size_t> status_roles;
  for (const char* role : kSetpointRoles)
    setpoint.push_back(config.registers.at(role));
  for (std::size_t i = 0; i < kStatusRoles.size(); ++i) {
    const auto found = config.registers.find(kStatusRoles[i]);
    if (found == config.registers.end()) continue;
    status.push_back(found->second);
    status_roles.push_back(i);
  }
  return std::unique_ptr<Exciter>(
      std::make_unique<ModbusExciter>(config, clock, std::move(*connection), std::move(setpoint),
                                      std::move(status), std::move(status_roles)));
}

}  // namespace shaker::drivers::modbus
