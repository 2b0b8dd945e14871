#include "cli/campaign_units.hpp"

#include <fmt/format.h>

#include "config/length_unit.hpp"

namespace shaker::cli {
namespace {

using config::metres;
using config::Node;

constexpr double kLargestScale = 1e12;

class Units {
 public:
  Units(const Node& node, const std::string& pointer, config::Findings& findings,
        const std::string& length_unit, double mass)
      : findings_(findings),
        reader_(node, pointer, findings),
        length_(length_unit),
        metre_(metres(length_unit)),
        mass_(mass) {}

  Factors factors() {
    Factors factors;
    factors.time = factor("time").value_or(1.0);
    factors.displacement = factor("displacement").value_or(1.0);
    factors.excitation = factor("excitation").value_or(1.0);
    // An accelerometer counts as the table's does unless it is said otherwise.
    factors.acceleration = factor("acceleration").value_or(factors.excitation);
    factors.force = factor("force").value_or(1.0);
    reader_.finish();
    return factors;
  }

 private:
  // A name that is known, or a label of the campaign's own with the size of one in the model's
  // unit. Nothing where it is not said, or wrong.
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
    if (!length && (unit == "N" || unit == "kN")) return newtons(name, unit);
    const auto slash = unit.find("/s^2");
    std::optional<double> given;
    if (length)
      given = metres(unit);
    else if (slash != std::string::npos)
      given = metres(unit.substr(0, slash));
    else if (unit == "g")
      given = 9.80665;
    if (given && metre_) return *given / *metre_;
    reader_.complain(
        name, fmt::format("\"{}\" and the model's \"{}\" do not match; say {{\"label\": \"{}\", "
                          "\"scale\": ...}} with the size of one {} in {}",
                          unit, wanted, unit, unit, wanted));
    return std::nullopt;
  }

  std::optional<double> time(const std::string& unit) {
    if (unit == "s") return 1.0;
    if (unit == "ms") return 1e-3;
    if (unit == "us") return 1e-6;
    reader_.complain("time", fmt::format("is \"{}\"; it is s, ms or us", unit));
    return std::nullopt;
  }

  // Effects are forces over a mass.
  std::optional<double> newtons(const std::string& name, const std::string& unit) {
    if (mass_ > 0.0 && metre_) return (unit == "kN" ? 1e3 : 1.0) / mass_ / *metre_;
    reader_.complain(name, fmt::format("is \"{}\", but the model counts forces over a mass, in "
                                       "{}/s^2: give /reference_mass in kg, above 0",
                                       unit, length_));
    return std::nullopt;
  }

  config::Findings& findings_;
  config::ObjectReader reader_;
  std::string length_;
  std::optional<double> metre_;
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
