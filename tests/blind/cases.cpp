#include "tests/blind/cases.hpp"

namespace shaker::blind {
namespace {

// This is RigOptions::quantum_m and not a parameter of the plant.
constexpr const char* kQuantum = "sensor_quantum";

std::vector<Kind> frictions() {
  return {
      {"coulomb_friction",
       true,
       {{{"coulomb_friction", 0.02}}, {{"coulomb_friction", 0.1}}, {{"coulomb_friction", 0.4}}}},
      {"pressure_friction",
       true,
       {{{"pressure_friction", 0.003}},
        {{"pressure_friction", 0.01}},
        {{"pressure_friction", 0.04}}}},
      {"stribeck_friction",
       true,
       {{{"coulomb_friction", 0.1}, {"stribeck_ratio", 1.5}, {"stribeck_speed", 0.03}},
        {{"coulomb_friction", 0.2}, {"stribeck_ratio", 1.6}, {"stribeck_speed", 0.04}},
        {{"coulomb_friction", 0.3}, {"stribeck_ratio", 2.0}, {"stribeck_speed", 0.05}}}},
      {"presliding_friction",
       true,
       {{{"presliding_friction", 0.1}, {"presliding_distance", 1e-3}},
        {{"presliding_friction", 0.2}, {"presliding_distance", 2e-3}},
        {{"presliding_friction", 0.4}, {"presliding_distance", 3e-3}}}},
      {"bouc_wen_hysteresis",
       true,
       {{{"bouc_wen_stiffness", 20}, {"bouc_wen_b", 200}, {"bouc_wen_c", 100}},
        {{"bouc_wen_stiffness", 60}, {"bouc_wen_b", 200}, {"bouc_wen_c", 100}},
        {{"bouc_wen_stiffness", 150}, {"bouc_wen_b", 300}, {"bouc_wen_c", 100}}}},
  };
}

std::vector<Kind> orifices_gas_and_stops() {
  return {
      {"viscous_damping",
       true,
       {{{"viscous_damping", 0.1}}, {{"viscous_damping", 0.4}}, {{"viscous_damping", 1.5}}}},
      {"laminar_orifice",
       true,
       {{{"laminar_speed", 0.02}}, {{"laminar_speed", 0.05}}, {{"laminar_speed", 0.1}}}},
      {"rebound_damping",
       true,
       {{{"rebound_factor", 1.05}}, {{"rebound_factor", 1.3}}, {{"rebound_factor", 3.0}}}},
      {"metering_pin",
       true,
       {{{"metering_k1", 0.1}}, {{"metering_k1", 0.25}}, {{"metering_k1", 0.5}}}},
      {"relief_valve",
       true,
       {{{"relief_force", 0.5}, {"relief_share", 0.7}},
        {{"relief_force", 0.4}, {"relief_share", 0.5}},
        {{"relief_force", 0.3}, {"relief_share", 0.2}}}},
      {"oil_compressibility",
       true,
       {{{"oil_stiffness", 10000}}, {{"oil_stiffness", 3000}}, {{"oil_stiffness", 1000}}}},
      {"gas_heat_transfer",
       true,
       {{{"gas_heat_tau", 2.0}}, {{"gas_heat_tau", 0.5}}, {{"gas_heat_tau", 0.1}}}},
      {"real_gas",
       true,
       {{{"gas_virial", 0.002}}, {{"gas_virial", 0.006}}, {{"gas_virial", 0.02}}}},
      {"second_chamber",
       true,
       {{{"second_chamber_knee", 0.165}, {"second_chamber_share", 0.8}},
        {{"second_chamber_knee", 0.162}, {"second_chamber_share", 0.7}},
        {{"second_chamber_knee", 0.16}, {"second_chamber_share", 0.6}}}},
      {"end_stop",
       true,
       {{{"end_stop_stiffness", 100}, {"end_stop_position", 0.168}},
        {{"end_stop_stiffness", 300}, {"end_stop_position", 0.166}},
        {{"end_stop_stiffness", 1000}, {"end_stop_position", 0.164}}}},
      {"cavitation",
       true,
       {{{"cavitation_force", 0.7}}, {{"cavitation_force", 0.4}}, {{"cavitation_force", 0.2}}}},
  };
}

std::vector<Kind> springs_and_masses() {
  return {
      {"cubic_stiffness",
       true,
       {{{"cubic_stiffness", 500}, {"cubic_stiffness_centre", 0.16}},
        {{"cubic_stiffness", 3000}, {"cubic_stiffness_centre", 0.16}},
        {{"cubic_stiffness", 15000}, {"cubic_stiffness_centre", 0.16}}}},
      {"linear_stiffness",
       true,
       {{{"linear_stiffness", 1}, {"linear_stiffness_centre", 0.16}},
        {{"linear_stiffness", 5}, {"linear_stiffness_centre", 0.16}},
        {{"linear_stiffness", 20}, {"linear_stiffness_centre", 0.16}}}},
      {"added_mass",
       true,
       {{{"added_mass", 0.01}}, {{"added_mass", 0.04}}, {{"added_mass", 0.15}}}},
      {"tyre",
       true,
       {{{"tyre_stiffness", 8000}}, {{"tyre_stiffness", 3000}}, {{"tyre_stiffness", 1200}}}},
      {"series_compliance",
       true,
       {{{"series_stiffness", 2e4}}, {{"series_stiffness", 7e3}}, {{"series_stiffness", 2e3}}}},
  };
}

std::vector<Kind> instruments() {
  return {
      {"sensor_gain",
       true,
       {{{"sensor_gain", 1.01}}, {{"sensor_gain", 1.03}}, {{"sensor_gain", 1.1}}}},
      {"sensor_delay",
       true,
       {{{"sensor_delay", 1e-3}}, {{"sensor_delay", 4e-3}}, {{"sensor_delay", 15e-3}}}},
      {"sensor_lag",
       true,
       {{{"sensor_lag", 1e-3}}, {{"sensor_lag", 5e-3}}, {{"sensor_lag", 20e-3}}}},
      {"sensor_nonlinearity",
       true,
       {{{"sensor_quadratic", 0.1}}, {{"sensor_quadratic", 0.3}}, {{"sensor_quadratic", 1.0}}}},
      {"sensor_drift",
       true,
       {{{"sensor_drift", 1e-6}}, {{"sensor_drift", -1e-5}}, {{"sensor_drift", 1e-4}}}},
      {"sensor_quantisation", true, {{{kQuantum, 1e-4}}, {{kQuantum, 4e-4}}, {{kQuantum, 1e-3}}}},
      {"exciter_gain",
       true,
       {{{"excitation_sensor_gain", 1.01}},
        {{"excitation_sensor_gain", 1.03}},
        {{"excitation_sensor_gain", 1.1}}}},
      {"exciter_delay",
       true,
       {{{"excitation_sensor_delay", 1e-3}},
        {{"excitation_sensor_delay", 4e-3}},
        {{"excitation_sensor_delay", 12e-3}}}},
      {"exciter_phase",
       true,
       {{{"excitation_sensor_phase", 0.01}},
        {{"excitation_sensor_phase", -0.04}},
        {{"excitation_sensor_phase", 0.15}}}},
      {"exciter_distortion",
       true,
       {{{"excitation_h3", 0.003}, {"excitation_unrecorded", 1}},
        {{"excitation_h3", 0.02}, {"excitation_unrecorded", 1}},
        {{"excitation_h2", 0.08}, {"excitation_h3", 0.05}, {"excitation_unrecorded", 1}}}},
  };
}

// Effects that the catalogue does not have.
std::vector<Kind> outside_the_catalogue() {
  return {
      {"detent",
       false,
       {{{"detent_force", 0.05}, {"detent_pitch", 0.008}},
        {{"detent_force", 0.15}, {"detent_pitch", 0.008}},
        {{"detent_force", 0.4}, {"detent_pitch", 0.01}}}},
      {"notch_damping",
       false,
       {{{"notch_factor", 2.0}, {"notch_centre", 0.158}, {"notch_width", 4e-3}},
        {{"notch_factor", 4.0}, {"notch_centre", 0.158}, {"notch_width", 4e-3}},
        {{"notch_factor", 8.0}, {"notch_centre", 0.158}, {"notch_width", 5e-3}}}},
      {"leaning_bearing",
       false,
       {{{"leaning_friction", 10}, {"leaning_middle", 0.16}},
        {{"leaning_friction", 30}, {"leaning_middle", 0.16}},
        {{"leaning_friction", 60}, {"leaning_middle", 0.16}}}},
  };
}

}  // namespace

// The sizes are those of a laboratory: small ones move the stroke by some micrometres to some
// tens of micrometres, large ones by tenths of a millimetre to millimetres.
std::span<const Kind> kinds() {
  static const std::vector<Kind> all = [] {
    std::vector<Kind> joined;
    for (const auto& part : {frictions(), orifices_gas_and_stops(), springs_and_masses(),
                             instruments(), outside_the_catalogue()})
      joined.insert(joined.end(), part.begin(), part.end());
    return joined;
  }();
  return all;
}

std::span<const Pair> pairs() {
  static const std::vector<Pair> all = {
      {"coulomb_friction", "rebound_damping", {{"coulomb_friction", 0.2}, {"rebound_factor", 1.5}}},
      {"coulomb_friction",
       "end_stop",
       {{"coulomb_friction", 0.2}, {"end_stop_stiffness", 500}, {"end_stop_position", 0.165}}},
      {"viscous_damping",
       "cubic_stiffness",
       {{"viscous_damping", 0.8}, {"cubic_stiffness", 10000}, {"cubic_stiffness_centre", 0.16}}},
      {"gas_heat_transfer", "coulomb_friction", {{"gas_heat_tau", 0.5}, {"coulomb_friction", 0.3}}},
      {"sensor_delay", "coulomb_friction", {{"sensor_delay", 5e-3}, {"coulomb_friction", 0.2}}},
      {"metering_pin",
       "presliding_friction",
       {{"metering_k1", 0.4}, {"presliding_friction", 0.3}, {"presliding_distance", 2e-3}}},
      {"sensor_drift", "rebound_damping", {{"sensor_drift", 2e-5}, {"rebound_factor", 1.5}}},
      {"sensor_quantisation", "coulomb_friction", {{kQuantum, 5e-4}, {"coulomb_friction", 0.3}}}};
  return all;
}

std::span<const Noise> noises() {
  static const Noise all[] = {{"quiet", 5e-6, 1e-3}, {"usual", 2e-5, 5e-3}, {"loud", 1e-4, 2e-2}};
  return all;
}

std::span<const Design> designs() {
  static const std::vector<Design> all = {{"slow",
                                           {{"r01", 0.5, 1.5, false},
                                            {"r02", 0.8, 3.0, false},
                                            {"r03", 1.0, 2.0, false},
                                            {"r04", 1.4, 4.0, false},
                                            {"r05", 0.7, 2.0, true},
                                            {"r06", 1.2, 3.0, true}}},
                                          {"wide",
                                           {{"r01", 1.0, 3.0, false},
                                            {"r02", 2.0, 1.5, false},
                                            {"r03", 2.0, 4.0, false},
                                            {"r04", 4.0, 6.0, false},
                                            {"r05", 1.5, 2.5, true},
                                            {"r06", 3.0, 5.0, true}}},
                                          {"fast",
                                           {{"r01", 2.0, 3.0, false},
                                            {"r02", 3.0, 6.0, false},
                                            {"r03", 4.5, 6.0, false},
                                            {"r04", 6.0, 12.0, false},
                                            {"r05", 2.5, 4.0, true},
                                            {"r06", 5.0, 9.0, true}}}};
  return all;
}

sim::CampaignRecording recording(const Design& design, const Noise& noise, const Truth& truth,
                                 std::uint64_t seed) {
  sim::CampaignRecording campaign;
  campaign.rig.parameters = truth;
  if (const auto step = campaign.rig.parameters.extract(std::string(kQuantum)))
    campaign.rig.quantum_m = step.mapped();
  campaign.rig.noise_m = noise.displacement;
  campaign.rig.noise_m_s2 = noise.excitation;
  campaign.rig.clock_offset_ppm = 50.0;
  campaign.rig.seed = seed;
  campaign.runs = design.runs;
  return campaign;
}

}  // namespace shaker::blind
