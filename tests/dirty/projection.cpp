#include <cmath>
#include <limits>

#include "tests/dirty/campaign.hpp"

namespace shaker::dirty {
namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += a[i] * b[i];
  return sum;
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> result(a);
  for (std::size_t i = 0; i < a.size(); ++i)
    result[i] -= b[i];
  return result;
}

// Takes out of `y` what the orthonormal columns hold; twice, against rounding.
void reduce(std::vector<double>& y, const std::vector<std::vector<double>>& columns) {
  for (int pass = 0; pass < 2; ++pass)
    for (const std::vector<double>& column : columns) {
      const double share = dot(y, column);
      for (std::size_t i = 0; i < y.size(); ++i)
        y[i] -= share * column[i];
    }
}

}  // namespace

double spread(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double mean = 0.0, square = 0.0;
  for (const double value : values)
    mean += value / count;
  for (const double value : values)
    square += (value - mean) * (value - mean) / count;
  return std::sqrt(square);
}

double quantised(double value, double step) {
  return step > 0.0 ? step * std::round(value / step) : value;
}

double quantum(const Effects& hidden) {
  const auto found = hidden.find("sensor_quantisation");
  return found == hidden.end() ? 0.0 : found->second.at("q");
}

Effects all_hidden(const Campaign& c) {
  Effects hidden = c.effects;
  hidden.insert(c.unknown.begin(), c.unknown.end());
  return hidden;
}

std::vector<double> responses(const Campaign& c, const Effects& hidden, bool changes) {
  const Device device(c.base, hidden, c.weight);
  std::vector<double> all;
  for (Run run : c.runs) {
    if (!changes) run.change = {};
    const std::vector<double> one = moved(device, hidden, run).response;
    for (const double value : one)
      all.push_back(quantised(value, quantum(hidden)));
  }
  return all;
}

Projection::Projection(const Campaign& campaign) {
  const std::vector<double> here = responses(campaign, {}, false);
  const auto add = [&](const Campaign& there) {
    std::vector<double> column = difference(responses(there, {}, false), here);
    const double size = std::sqrt(dot(column, column));
    if (!(size > 0.0)) return;
    for (double& value : column)
      value /= size;
    reduce(column, columns_);
    const double left = std::sqrt(dot(column, column));
    if (!(left > 1e-8)) return;
    for (double& value : column)
      value /= left;
    columns_.push_back(column);
  };
  for (const auto& [parameter, value] : campaign.base) {
    Campaign there = campaign;
    there.base[parameter] = value * (1.0 + 1e-5);
    add(there);
  }
  if (campaign.kind != "decay" && campaign.kind != "drop") return;
  for (std::size_t i = 0; i < campaign.runs.size(); ++i) {
    Campaign there = campaign;
    there.runs[i].start_stroke += 1e-6;
    add(there);
    there = campaign;
    there.runs[i].start_velocity += 1e-5;
    add(there);
  }
}

double Projection::visible(const std::vector<double>& with,
                           const std::vector<double>& without) const {
  std::vector<double> left = difference(with, without);
  reduce(left, columns_);
  const double square = dot(left, left) / static_cast<double>(left.size());
  return std::isfinite(square) ? std::sqrt(square) : std::numeric_limits<double>::infinity();
}

void measure(Campaign& campaign, const Projection& projection) {
  const std::vector<double> all = responses(campaign, all_hidden(campaign), true);
  for (const auto& [name, parameters] : all_hidden(campaign)) {
    Effects others = all_hidden(campaign);
    others.erase(name);
    campaign.visible[name] = projection.visible(all, responses(campaign, others, true));
  }
  const std::vector<double> base = responses(campaign, {}, false);
  campaign.gap_alone = projection.visible(responses(campaign, campaign.unknown, true), base);
  campaign.motion = spread(base);
}

}  // namespace shaker::dirty
