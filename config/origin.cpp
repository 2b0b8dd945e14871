#include "config/origin.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::config {
namespace {

struct SpecimenKey {
  const char* key;
  std::string Specimen::*field;
  std::optional<Dimension> dimension;  // empty: any text
};
constexpr SpecimenKey kSpecimenKeys[] = {
    {"name", &Specimen::name, {}},
    {"serial", &Specimen::serial, {}},
    {"charge", &Specimen::charge, Dimension::pressure},
    {"oil", &Specimen::oil, {}},
    {"temperature", &Specimen::temperature, Dimension::temperature},
    {"notes", &Specimen::notes, {}}};
constexpr std::size_t kSpecimenTextMax = 2000;  // bytes

// Empty if `text` is a number and a unit of that dimension, otherwise what is wrong.
std::string fault_of_quantity(const std::string& text, Dimension dimension) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  std::string_view unit(read.ptr, static_cast<std::size_t>(end - read.ptr));
  while (unit.starts_with(' '))
    unit.remove_prefix(1);
  if (read.ec == std::errc() && unit_called(unit, dimension)) return {};
  return fmt::format("\"{}\" is no number with a unit; write one of {} behind the number", text,
                     units_of(dimension));
}

std::string fault_of_entry(const SpecimenKey& entry, const std::string& text) {
  if (text.size() > kSpecimenTextMax)
    return fmt::format("{} bytes are too many; {} are allowed", text.size(), kSpecimenTextMax);
  if (text.empty() || !entry.dimension) return {};
  return fault_of_quantity(text, *entry.dimension);
}

bool is_date(const std::string& text) {
  constexpr std::string_view kPattern = "dddd-dd-dd";
  if (text.size() != kPattern.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool digit = std::isdigit(static_cast<unsigned char>(text[i])) != 0;
    if (kPattern[i] == 'd' ? !digit : text[i] != '-') return false;
  }
  const int month = std::stoi(text.substr(5, 2)), day = std::stoi(text.substr(8, 2));
  return month >= 1 && month <= 12 && day >= 1 && day <= 31;
}

void read_date(ObjectReader& reader, const char* key, std::string& date) {
  reader.required(key, date);
  if (!date.empty() && !is_date(date))
    reader.complain(key, fmt::format("\"{}\" is no date; write it as 2026-03-01", date));
}

// Converts the uncertainty into the channel's own unit.
void convert_uncertainty(ObjectReader& reader, const std::string& own, Calibration& calibration) {
  if (calibration.unit.empty()) calibration.unit = own;
  const auto known = conversion(calibration.unit, own);
  if (!known) {
    reader.complain("unit", fmt::format("\"{}\" cannot be converted into {}; known are {}",
                                        calibration.unit, own, units_like(own)));
    return;
  }
  calibration.uncertainty *= known->scale;
  calibration.unit = own;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> entries(const Specimen& specimen) {
  std::vector<std::pair<std::string, std::string>> found;
  for (const SpecimenKey& entry : kSpecimenKeys) {
    if (!(specimen.*entry.field).empty()) found.emplace_back(entry.key, specimen.*entry.field);
  }
  return found;
}

Result<void> set_entry(Specimen& specimen, std::string_view key, const std::string& text) {
  std::vector<std::string> known;
  for (const SpecimenKey& entry : kSpecimenKeys) {
    known.emplace_back(entry.key);
    if (key != entry.key) continue;
    if (const auto fault = fault_of_entry(entry, text); !fault.empty())
      return Error{ErrorKind::invalid, fmt::format("specimen: {}: {}", key, fault)};
    specimen.*entry.field = text;
    return {};
  }
  return Error{ErrorKind::invalid, fmt::format("specimen: \"{}\" is not known; {}", key,
                                               suggestion(std::string(key), known))};
}

void read_specimen(const Node& node, const std::string& pointer, Findings& findings,
                   Specimen& specimen) {
  ObjectReader reader(node, pointer, findings);
  for (const SpecimenKey& entry : kSpecimenKeys) {
    std::string& text = specimen.*entry.field;
    reader.optional(entry.key, text);
    if (const auto fault = fault_of_entry(entry, text); !fault.empty())
      reader.complain(entry.key, fault);
  }
  reader.finish();
}

void read_calibrations(const Node& node, const std::string& pointer, Findings& findings,
                       const protocol::ChannelLabels& labels, Calibrations& calibrations) {
  ObjectReader reader(node, pointer, findings);
  for (int i = 0; i < protocol::kChannelCount; ++i) {
    const auto channel = static_cast<protocol::Channel>(i);
    const std::string key(protocol::name(channel));
    const Node* entry = reader.member(key, false);
    if (!entry) continue;
    Calibration calibration;
    ObjectReader inner(*entry, reader.at(key), findings);
    inner.optional("sensor", calibration.sensor);
    inner.required("serial", calibration.serial);
    read_date(inner, "date", calibration.date);
    read_date(inner, "due", calibration.due);
    if (is_date(calibration.date) && is_date(calibration.due) &&
        calibration.due <= calibration.date) {
      inner.complain("due", fmt::format("{} is not after the calibration of {}", calibration.due,
                                        calibration.date));
    }
    inner.required("uncertainty", calibration.uncertainty, above(0));
    inner.optional("unit", calibration.unit);
    inner.finish();
    convert_uncertainty(inner, protocol::label(channel, labels).unit, calibration);
    calibrations.emplace(channel, std::move(calibration));
  }
  reader.finish();
}

}  // namespace shaker::config
