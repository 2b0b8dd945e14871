#include "cli/model_units.hpp"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::cli {
namespace {

using config::Node;

constexpr double kLargestScale = 1e12;
constexpr double kSameFactor = 1e-9;  // relative

// Reads the members of "units".
class StatedUnits {
 public:
  StatedUnits(const Node& node, const std::string& pointer, config::Findings& findings,
              const ModelUnits& model)
      : findings_(findings), reader_(node, pointer, findings), model_(model) {}

  Factors factors() {
    Factors factors;
    factors.time = factor("time", "t");
    for (const auto& [name, stated] :
         {std::pair{"displacement", &Factors::displacement},
          std::pair{"excitation", &Factors::excitation},
          std::pair{"acceleration", &Factors::acceleration}, std::pair{"force", &Factors::force}})
      factors.*stated = factor(name, name);
    reader_.finish();
    return factors;
  }

 private:
  // The factor of a known unit, or of the campaign's own unit, given as a label and its size in
  // the model's unit. nullopt when it is absent or wrong.
  std::optional<double> factor(const std::string& name, const std::string& channel) {
    const Node* unit = reader_.member(name, false);
    if (unit == nullptr) return std::nullopt;
    if (unit->kind == Node::Kind::string) {
      if (unit->text.empty() && name != "time") return 1.0;
      const auto found = model_.factor(channel, unit->text);
      if (found) return *found;
      reader_.complain(name, fmt::format("{}. For another one, say {{\"label\": \"{}\", \"scale\": "
                                         "...}} with the size of one {} in the model's unit",
                                         found.error().what, unit->text, unit->text));
      return std::nullopt;
    }
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

  config::Findings& findings_;
  config::ObjectReader reader_;
  const ModelUnits& model_;
};

Error refused(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

}  // namespace

Result<double> ModelUnits::factor(const std::string& channel, const std::string& unit) const {
  if (channel == "t") {
    if (const auto known = unit_called(unit, Dimension::time)) return known->scale;
    return refused(
        fmt::format("\"{}\" is no unit of time; known are {}", unit, units_of(Dimension::time)));
  }
  const bool is_length = channel == "displacement" || channel == "y";
  const std::string wanted = is_length ? length : length + "/s^2";
  // A model counts in a length or in an angle; in another unit of its own nothing is converted.
  const auto own = unit_called(length);
  const bool is_angle = own && own->dimension == Dimension::angle;
  if (unit == wanted) return 1.0;
  if (const auto force = unit_called(unit, Dimension::force); force && !is_length) {
    // The model's effects are forces per unit mass.
    if (mass > 0.0 && own && !is_angle) return force->scale / mass / own->scale;
    return refused(
        fmt::format("is \"{}\", but the model counts forces over a mass, in {}: give "
                    "/reference_mass in kg, above 0",
                    unit, wanted));
  }
  const auto dimension = is_angle    ? Dimension::angle
                         : is_length ? Dimension::length
                                     : Dimension::acceleration;
  constexpr std::string_view kPerSecondSquared = "/s^2";
  std::string counted = unit;  // of deg/s^2, deg
  if (is_angle && !is_length && counted.ends_with(kPerSecondSquared))
    counted.resize(counted.size() - kPerSecondSquared.size());
  const auto given = unit_called(counted, dimension);
  if (given && own) return given->scale / own->scale;
  return refused(fmt::format("\"{}\" and the model's \"{}\" do not match; known are {}{}", unit,
                             wanted, units_of(dimension),
                             is_length ? "" : ", " + units_of(Dimension::force)));
}

Factors read_units(config::ObjectReader& document, config::Findings& findings,
                   const ModelUnits& model) {
  const Node* units = document.member("units", false);
  return units == nullptr ? Factors{}
                          : StatedUnits(*units, document.at("units"), findings, model).factors();
}

Result<double> column_factor(const CsvTable& table, const std::string& origin,
                             const std::string& column, const std::string& channel,
                             const ModelUnits& model, std::optional<double> stated) {
  const auto unit = table.units.find(column);
  if (unit == table.units.end()) return stated.value_or(1.0);
  const auto refuse = [&](const std::string& why) {
    return refused(fmt::format("{}:1: column \"{}\": {}", origin, column, why));
  };
  const auto found = model.factor(channel, unit->second);
  if (!found)
    return refuse(found.error().what +
                  ". Convert the column, or state a known unit behind its name");
  if (stated && std::fabs(*stated / *found - 1.0) > kSameFactor)
    return refuse(
        fmt::format("is in \"{}\" by the header row, and in another unit by /units of "
                    "campaign.json; mend the one that is wrong",
                    unit->second));
  return found;
}

Result<void> to_model_units(CsvTable& table, const std::string& origin, const ModelUnits& model) {
  for (auto& [name, values] : table.columns) {
    const auto factor = column_factor(table, origin, name, name, model, std::nullopt);
    if (!factor) return factor.error();
    for (double& value : values)
      value *= *factor;
  }
  return {};
}

}  // namespace shaker::cli
