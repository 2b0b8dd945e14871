#include "cli/campaign_units.hpp"

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::cli {
namespace {

using config::Node;

constexpr double kLargestScale = 1e12;

class Units {
 public:
  Units(const Node& node, const std::string& pointer, config::Findings& findings,
        const std::string& length_unit, double mass)
      : findings_(findings),
        reader_(node, pointer, findings),
        length_(length_unit),
        metre_(unit_called(length_unit, Dimension::length)),
        mass_(mass) {}

  Factors factors() {
    Factors factors;
    factors.time = factor("time").value_or(1.0);
    factors.displacement = factor("displacement").value_or(1.0);
    factors.excitation = factor("excitation").value_or(1.0);
    // The accelerometer has the unit of the table's acceleration unless the file gives another
    // one.
    factors.acceleration = factor("acceleration").value_or(factors.excitation);
    factors.force = factor("force").value_or(1.0);
    reader_.finish();
    return factors;
  }

 private:
  // The factor of a known unit, or of the campaign's own unit, given as a label and its size in
  // the model's unit. nullopt when it is absent or wrong.
  std::optional<double> factor(const std::string& name) {
    const Node* unit = reader_.member(name, false);
    if (unit == nullptr) return std::nullopt;
    if (unit->kind == Node::Kind::string)
      return name == "time" ? time(unit->text) : known(name, unit->text);
    if (unit->kind != Node::Kind::object) {
      reader_.complain(name, fmt::format("{} is neither a unit nor an object of label and scale",
                                         unit->shown()));
      return std::nullopt;
    }
    config::ObjectReader own(*unit, reader_.at(name), findings_);
    std::string label;
    double scale = 1.0;
    own.required("label", label);
    own.required("scale", scale, config::above(0).at_most(kLargestScale));
    own.finish();
    return scale;
  }

  std::optional<double> known(const std::string& name, const std::string& unit) {
    const bool length = name == "displacement";
    const std::string wanted = length ? length_ : length_ + "/s^2";
    if (unit.empty() || unit == wanted) return 1.0;
    if (const auto force = unit_called(unit, Dimension::force); force && !length)
      return over_mass(name, *force);
    const auto given = unit_called(unit, length ? Dimension::length : Dimension::acceleration);
    if (given && metre_) return given->scale / metre_->scale;
    reader_.complain(
        name,
        fmt::format("\"{}\" and the model's \"{}\" do not match; known are {}{}. For another one, "
                    "say {{\"label\": \"{}\", \"scale\": ...}} with the size of one {} in {}",
                    unit, wanted, units_of(length ? Dimension::length : Dimension::acceleration),
                    length ? "" : ", " + units_of(Dimension::force), unit, unit, wanted));
    return std::nullopt;
  }

  std::optional<double> time(const std::string& unit) {
    if (const auto known = unit_called(unit, Dimension::time)) return known->scale;
    reader_.complain("time", fmt::format("\"{}\" is no unit of time; known are {}", unit,
                                         units_of(Dimension::time)));
    return std::nullopt;
  }

  // A force becomes an acceleration: the model's effects are forces per unit mass.
  std::optional<double> over_mass(const std::string& name, const Unit& force) {
    if (mass_ > 0.0 && metre_) return force.scale / mass_ / metre_->scale;
    reader_.complain(name, fmt::format("is \"{}\", but the model counts forces over a mass, in "
                                       "{}/s^2: give /reference_mass in kg, above 0",
                                       force.name, length_));
    return std::nullopt;
  }

  config::Findings& findings_;
  config::ObjectReader reader_;
  std::string length_;
  std::optional<Unit> metre_;  // of length; nullopt when it is unknown
  double mass_;
};

}  // namespace

Factors read_units(config::ObjectReader& document, config::Findings& findings,
                   const std::string& length_unit) {
  double mass = 0.0;
  document.optional("reference_mass", mass, config::above(0).at_most(1e6));
  const Node* units = document.member("units", false);
  return units == nullptr
             ? Factors{}
             : Units(*units, document.at("units"), findings, length_unit, mass).factors();
}

}  // namespace shaker::cli
