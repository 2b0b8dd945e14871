#include "sim/virtual_rig.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "sim/controller.hpp"
#include "sim/instruments.hpp"
#include "sim/integrator.hpp"

namespace shaker::sim {
namespace {

constexpr std::string_view kFaultNames[kFaultCount] = {
    "none",         "sensor_frozen", "sensor_nan",    "sensor_silent", "sensor_inverted",
    "exciter_trip", "exciter_deaf",  "exciter_silent"};

void require(bool ok, std::string_view what, double value, std::string_view allowed) {
  if (!ok) throw std::invalid_argument(fmt::format("{} = {}; it must be {}", what, value, allowed));
}

const RigOptions& checked(const RigOptions& o) {
  require(o.sample_rate_hz >= 1.0 && o.sample_rate_hz <= 1e5, "sample_rate_hz", o.sample_rate_hz,
          "1 .. 100000");
  require(o.noise_m >= 0.0 && o.noise_m < 1.0, "noise_m", o.noise_m, "0 .. 1 m");
  require(o.noise_m_s2 >= 0.0 && o.noise_m_s2 < 100.0, "noise_m_s2", o.noise_m_s2, "0 .. 100");
  require(o.quantum_m >= 0.0 && o.quantum_m < 1.0, "quantum_m", o.quantum_m, "0 .. 1 m");
  require(o.quantum_m_s2 >= 0.0 && o.quantum_m_s2 < 100.0, "quantum_m_s2", o.quantum_m_s2,
          "0 .. 100");
  require(o.clock_offset_ppm >= -1e5 && o.clock_offset_ppm <= 1e5, "clock_offset_ppm",
          o.clock_offset_ppm, "-100000 .. 100000");
  require(o.jitter_fraction >= 0.0 && o.jitter_fraction < 1.0, "jitter_fraction", o.jitter_fraction,
          "at least 0 and below 1");
  require(o.dropout_fraction >= 0.0 && o.dropout_fraction <= 1.0, "dropout_fraction",
          o.dropout_fraction, "0 .. 1");
  require(o.heartbeat_timeout_s >= 0.0 && o.heartbeat_timeout_s <= kLongestHeartbeatTimeout,
          "heartbeat_timeout_s", o.heartbeat_timeout_s, "0 .. 60 s");
  return o;
}

// Moves the instruments' parameters out of `mixed`, which keeps those of the plant.
Values take_instruments(std::map<std::string, double>& mixed) {
  Values values;
  for (const auto& parameter : instrument_parameters()) {
    double value = parameter.standard;
    if (auto given = mixed.extract(std::string(parameter.name))) value = given.mapped();
    require(value >= parameter.lowest && value <= parameter.highest, parameter.name, value,
            fmt::format("{} .. {} {}", parameter.lowest, parameter.highest, parameter.unit));
    values.emplace(parameter.name, value);
  }
  return values;
}

TableMotion make_table(const RigOptions& options, const Values& values) {
  return TableMotion(1.0 + 1e-6 * options.clock_offset_ppm,
                     {values.at("excitation_h2"), values.at("excitation_h3"),
                      values.at("excitation_h4"), values.at("excitation_h5")},
                     values.at("table_gain"), values.at("table_drift"));
}

}  // namespace

std::string_view name(Fault fault) {
  return kFaultNames[static_cast<int>(fault)];
}

std::optional<Fault> fault_from_name(std::string_view text) {
  const auto found = std::ranges::find(kFaultNames, text);
  if (found == std::end(kFaultNames)) return std::nullopt;
  return static_cast<Fault>(found - std::begin(kFaultNames));
}

struct VirtualRig::Impl {
  Impl(const RigOptions& options, std::map<std::string, double> parameters, Nanoseconds begin)
      : start(begin),
        instrument_values(take_instruments(parameters)),
        plant(options.plant, parameters),
        controller(make_table(options, instrument_values), options.heartbeat_timeout_s),
        instruments(options, instrument_values, begin),
        auxiliary(options.auxiliary, options.seed),
        integrator(plant, plant.at_rest(), 0.0),
        truth(plant.values()) {
    truth.insert(instrument_values.begin(), instrument_values.end());
  }

  double since(Nanoseconds t) const { return seconds(t - start); }
  double now() const { return integrator.time(); }
  bool hears() const { return fault != Fault::exciter_silent; }
  const TableMotion& moving_table() const {
    return fault == Fault::exciter_deaf ? still : controller.table();
  }
  void move(double until);
  double between_the_ends() const;
  double recorded_excitation() const;
  AuxiliaryValues take_auxiliary();

  Nanoseconds start;
  Values instrument_values;
  Plant plant;
  Controller controller;
  TableMotion still;
  Instruments instruments;
  Auxiliary auxiliary;
  Integrator integrator;
  Values truth;
  Fault fault = Fault::none;
};

// Advances to `until`; the dead-man may stop the table on the way.
void VirtualRig::Impl::move(double until) {
  if (const double deadline = controller.deadline(); deadline <= until) {
    integrator.advance(deadline, moving_table());
    controller.trip(FaultCode::heartbeat_lost, deadline);
    integrator.table_changed();
  }
  integrator.advance(until, moving_table());
  if (integrator.take_bottomed()) {
    controller.trip(FaultCode::bottomed, now());
    integrator.table_changed();
  }
}

// What the transducer measures: the stroke and the deflection of the fixture under the damper's
// force.
double VirtualRig::Impl::between_the_ends() const {
  const double stroke = integrator.state()[0];
  const double stiffness = instrument_values.at("series_stiffness");
  if (stiffness == 0.0) return stroke;
  const double force = moving_table().acceleration(now()) - integrator.acceleration(moving_table());
  return stroke + force / stiffness;
}

double VirtualRig::Impl::recorded_excitation() const {
  const TableMotion& table = moving_table();
  const double seen = table.fundamental(now(), instrument_values.at("excitation_sensor_phase"));
  if (instrument_values.at("excitation_unrecorded") > 0.5) return seen;
  return seen + (table.acceleration(now()) - table.fundamental(now()));
}

AuxiliaryValues VirtualRig::Impl::take_auxiliary() {
  if (auxiliary.empty()) return {};
  const State& state = integrator.state();
  const double direction = state[1] > 0.0 ? 1.0 : state[1] < 0.0 ? -1.0 : 0.0;
  const Balance sum = plant.balance(state, direction);
  const auto gravity = plant.values().find("gravity");
  return auxiliary.take(
      {.t = now(),
       .u = state[0],
       .v = state[1],
       .sprung = moving_table().acceleration(now()) - integrator.acceleration(moving_table()),
       .weight = gravity == plant.values().end() ? 0.0 : gravity->second,
       .gas = sum.gas,
       .table = moving_table()});
}

VirtualRig::VirtualRig(const RigOptions& options, Nanoseconds start)
    : impl_(std::make_unique<Impl>(checked(options), options.parameters, start)) {}
VirtualRig::~VirtualRig() = default;

bool VirtualRig::set_frequency(double hz) {
  if (!impl_->hears()) return false;
  impl_->integrator.table_changed();
  return impl_->controller.set_frequency(hz, impl_->now());
}
bool VirtualRig::set_amplitude(double m_s2) {
  if (!impl_->hears()) return false;
  impl_->integrator.table_changed();
  return impl_->controller.set_amplitude(m_s2, impl_->now());
}
bool VirtualRig::set_enable(bool on) {
  if (!impl_->hears()) return false;
  impl_->integrator.table_changed();
  return impl_->controller.set_enable(on, impl_->now());
}
bool VirtualRig::set_ramp(double s) {
  return impl_->hears() && impl_->controller.set_ramp(s);
}
bool VirtualRig::set_heartbeat_timeout(double s) {
  return impl_->hears() && impl_->controller.set_heartbeat_timeout(s, impl_->now());
}
void VirtualRig::heartbeat(std::uint32_t counter) {
  if (impl_->hears()) impl_->controller.heartbeat(counter, impl_->now());
}
RigStatus VirtualRig::status() const {
  return impl_->controller.status(impl_->now());
}
RigSettings VirtualRig::settings() const {
  return impl_->controller.settings();
}
void VirtualRig::clear_fault() {
  if (impl_->hears()) impl_->controller.clear_fault();
}

void VirtualRig::inject(Fault fault) {
  impl_->integrator.table_changed();
  if (fault == Fault::exciter_trip) {
    impl_->controller.trip(FaultCode::tripped, impl_->now());
    return;
  }
  impl_->fault = fault;
}
Fault VirtualRig::injected() const {
  return impl_->fault;
}

void VirtualRig::advance(Nanoseconds now, std::vector<RigSample>& samples) {
  auto& it = *impl_;
  while (it.instruments.due() <= now) {
    const Nanoseconds due = it.instruments.due();
    it.instruments.deliver(due, samples);
    it.move(it.since(due));
    it.instruments.take(it.between_the_ends(), it.recorded_excitation(), it.take_auxiliary(),
                        it.fault);
  }
  it.move(it.since(now));
  it.instruments.deliver(now, samples);
}

Nanoseconds VirtualRig::next_sample() const {
  return impl_->instruments.next_delivery();
}

double VirtualRig::true_stroke() const {
  return impl_->integrator.state()[0];
}
double VirtualRig::true_velocity() const {
  return impl_->integrator.state()[1];
}
double VirtualRig::true_excitation() const {
  return impl_->moving_table().acceleration(impl_->now());
}
const std::map<std::string, double>& VirtualRig::true_parameters() const {
  return impl_->truth;
}

}  // namespace shaker::sim
