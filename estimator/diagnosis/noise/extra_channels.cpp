#include "estimator/diagnosis/noise/internal/extra_channels.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/noise/internal/noise.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGain = 0.005;       // standard error of a channel's own gain
constexpr double kDifference = 1e-3;  // of the driver, for slopes over it
constexpr double kMostOff = 0.5;      // of the channel's size, from what the motion says of it
constexpr int kSeen = 6;              // harmonics of that: twice derived, those above are noise

struct Channel {
  std::string name;
  const MatrixXd SteadyRun::*rows;
  std::vector<Quantity> maybe;
};

std::vector<Channel> channels() {
  return {{"force", &SteadyRun::force, {Quantity::damper_force}},
          {"acceleration",
           &SteadyRun::acceleration,
           {Quantity::acceleration, Quantity::absolute_acceleration}}};
}

// What samples say wrong of each harmonic of a channel that jumps, as acceleration and load do
// where dry friction turns. Harmonics of a jump fall like J / h, and a jump is known to half a
// sample: of N samples a cycle, each of its harmonics is off by up to 2 pi J / N times that
// half, 1.8 J / N root mean square. J is that of the upper quarter of the harmonics, without their
// noise; a channel without jumps has next to none.
double error_of_jumps(const RunDatum& datum, double samples_a_cycle) {
  const Index harmonics = (datum.response.size() - 1) / 2;
  const Index from = harmonics - harmonics / 4;
  double squares = 0.0;
  for (Index h = from; h <= harmonics; ++h) {
    const auto order = static_cast<double>(h);
    for (const Index c : {2 * h - 1, 2 * h})
      squares +=
          order * order * (datum.response[c] * datum.response[c] - datum.error[c] * datum.error[c]);
  }
  const double jump = std::sqrt(std::max(squares, 0.0) / static_cast<double>(harmonics - from + 1));
  return 1.8 * jump / samples_a_cycle;
}

// Of one channel, in the order of the runs that have it; `like` gets their places.
std::vector<RunDatum> data_of(const Channel& channel, const std::vector<SteadyRun>& runs,
                              const std::vector<RunDatum>& data, std::vector<std::size_t>& like) {
  std::vector<SteadyRun> some;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if ((runs[r].*channel.rows).rows() == 0) continue;
    some.push_back(runs[r]);
    some.back().name = fmt::format("{} ({})", runs[r].name, channel.name);
    some.back().response = runs[r].*channel.rows;
    like.push_back(r);
  }
  if (some.empty()) return {};
  std::vector<RunDatum> weighed = weigh(some).data;
  for (std::size_t k = 0; k < weighed.size(); ++k) {
    RunDatum& datum = weighed[k];
    datum.motion = data[like[k]].response;
    VectorXd moving = datum.response;
    moving[0] = 0.0;
    MatrixXd covariance = datum.error.cwiseAbs2().asDiagonal();
    covariance += kGain * kGain * moving * moving.transpose();
    covariance.diagonal().array() += std::pow(error_of_jumps(datum, some[k].samples_a_cycle), 2.0);
    covariance(0, 0) += moving.squaredNorm() + datum.response[0] * datum.response[0];
    set_covariance(datum, covariance);
  }
  return weighed;
}

// Of the channel over the driver's cosines and sines, by differences.
MatrixXd over_driver(const RunDatum& datum, const HarmonicFit& fit, std::size_t like) {
  const Model& model = *fit.run_models[like];
  const int points = fit.predictions[like].points();
  Prediction here(model, datum, points);
  here.start_from(fit.predictions[like]);
  MatrixXd slope = MatrixXd::Zero(datum.response.size(), datum.driver.size() - 1);
  if (!here.at(fit.theta)) return slope;
  const double h = kDifference * datum.driver.norm();
  for (Index c = 1; c < datum.driver.size(); ++c) {
    RunDatum moved = datum;
    moved.driver[c] += h;
    Prediction there(model, moved, points);
    there.start_from(here);
    if (there.at(fit.theta)) slope.col(c - 1) = (there.value() - here.value()) / h;
  }
  return slope;
}

// What the driver's own noise makes of the channel, as if none of its scatter were real: to be on
// the safe side.
void add_noise_of_driver(std::vector<RunDatum>& data, const std::vector<std::size_t>& like,
                         const std::vector<SteadyRun>& runs, const HarmonicFit& fit) {
  std::vector<Scatter> scatter;
  for (const std::size_t r : like)
    scatter.push_back({runs[r].frequency_hz, runs[r].driver});
  const CampaignNoise noise = campaign_noise(scatter);
  for (std::size_t k = 0; k < data.size(); ++k) {
    if (!runs[like[k]].driver_measured) continue;
    const MatrixXd slope = over_driver(data[k], fit, like[k]);
    const VectorXd variance = noise.runs[k].variance.tail(slope.cols());
    set_covariance(data[k],
                   covariance_of(data[k]) + slope * variance.asDiagonal() * slope.transpose());
  }
}

// The moving part of a quantity as the measured motion and excitation have it: a model that lacks
// an effect may be far off there. Load and absolute acceleration are x - u'' both.
VectorXd by_motion(const RunDatum& displacement, Quantity quantity) {
  const Index size = std::min({displacement.response.size(), displacement.driver.size(),
                               static_cast<Index>(harmonic_size(kSeen))});
  const double f = displacement.frequency_hz;
  const VectorXd a = derivative(derivative(displacement.response.head(size), f), f);
  const VectorXd seen =
      quantity == Quantity::acceleration ? a : VectorXd(displacement.driver.head(size) - a);
  return seen.tail(size - 1);
}

// The same of the fitted model: of several masses, or where displacement is not of the one mass.
VectorXd by_model(const RunDatum& datum, const HarmonicFit& fit, std::size_t like) {
  Prediction prediction(*fit.run_models[like], datum, fit.predictions[like].points());
  prediction.start_from(fit.predictions[like]);
  if (!prediction.at(fit.theta)) return {};
  return prediction.value().tail(prediction.value().size() - 1);
}

// How far the channel is from a quantity of the motion, over its size, in the worst run.
double off(std::vector<RunDatum>& some, const std::vector<std::size_t>& like,
           const std::vector<RunDatum>& data, const HarmonicFit& fit, Quantity quantity) {
  double worst = 0.0;
  for (std::size_t k = 0; k < some.size(); ++k) {
    some[k].quantity = quantity;
    const VectorXd expected = fit.model->mechanical() == 1 ? by_motion(data[like[k]], quantity)
                                                           : by_model(some[k], fit, like[k]);
    const VectorXd moving = some[k].response.tail(some[k].response.size() - 1);
    const Index size = std::min(moving.size(), expected.size());
    if (size == 0) return std::numeric_limits<double>::infinity();
    worst = std::max(worst,
                     (moving.head(size) - expected.head(size)).norm() / moving.head(size).norm());
  }
  return worst;
}

// `some` as that quantity, behind `all`.
void take(std::vector<RunDatum>& some, Quantity quantity, const std::vector<std::size_t>& like,
          const std::vector<SteadyRun>& runs, const HarmonicFit& fit, std::vector<RunDatum>& all) {
  for (RunDatum& datum : some)
    datum.quantity = quantity;
  add_noise_of_driver(some, like, runs, fit);
  std::move(some.begin(), some.end(), std::back_inserter(all));
}

}  // namespace

std::vector<RunDatum> extra_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                     const std::vector<RunDatum>& data,
                                     std::vector<std::string>& notes) {
  std::vector<RunDatum> all;
  for (const Channel& channel : channels()) {
    std::vector<std::size_t> like;
    std::vector<RunDatum> some = data_of(channel, runs, data, like);
    if (some.empty()) continue;
    Quantity nearest = channel.maybe.front();
    double least = std::numeric_limits<double>::infinity();
    for (const Quantity quantity : channel.maybe) {
      const double distance = off(some, like, data, fit, quantity);
      if (distance < least) {
        least = distance;
        nearest = quantity;
      }
    }
    if (!(least < kMostOff)) {
      notes.push_back(
          fmt::format("the channel {} is not used: it is {:.0f} % off what follows from the motion "
                      "for {}; check its "
                      "sign, its unit and what it measures",
                      channel.name, 100.0 * least,
                      nearest == Quantity::damper_force ? "the load between damper and mass"
                                                        : "the damper's acceleration"));
      continue;
    }
    take(some, nearest, like, runs, fit, all);
    notes.push_back(fmt::format(
        "the channel {} is used beside the displacement, as {}", channel.name,
        nearest == Quantity::damper_force   ? "load between damper and mass"
        : nearest == Quantity::acceleration ? "acceleration of the mass against the table"
                                            : "absolute acceleration of the mass"));
  }
  return all;
}

std::vector<RunDatum> same_channels(const std::vector<SteadyRun>& runs, const HarmonicFit& fit,
                                    const std::vector<RunDatum>& data,
                                    const std::vector<RunDatum>& before) {
  std::vector<RunDatum> all;
  for (const Channel& channel : channels()) {
    const auto used = std::find_if(before.begin(), before.end(), [&](const RunDatum& datum) {
      return std::find(channel.maybe.begin(), channel.maybe.end(), datum.quantity) !=
             channel.maybe.end();
    });
    if (used == before.end()) continue;
    std::vector<std::size_t> like;
    std::vector<RunDatum> some = data_of(channel, runs, data, like);
    take(some, used->quantity, like, runs, fit, all);
  }
  return all;
}

}  // namespace shaker::estimator::diagnosis
