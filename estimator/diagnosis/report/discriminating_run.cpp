#include "estimator/diagnosis/report/internal/discriminating_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFrequencies = 6;
constexpr double kSlower = 0.6, kFaster = 1.5;  // than the campaign's slowest and fastest run
constexpr double kAmplitudes[] = {0.5, 0.8, 1.1, 1.4};  // of the campaign's own at that frequency
constexpr double kBeyond = 0.1;          // of the stroke's range, on either side of it
constexpr double kSeparates = 3.0;       // standard errors
constexpr double kAccelerometer = 0.01;  // standard error, share of the reading

double amplitude_of(const RunDatum& datum) {
  return datum.driver.size() > 2 ? std::hypot(datum.driver[1], datum.driver[2]) : 0.0;
}

struct Reach {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(const PeriodicSystem& response, int coordinate) {
    for (int i = 0; i < response.points(); ++i) {
      low = std::min(low, response.value(i, coordinate));
      high = std::max(high, response.value(i, coordinate));
    }
  }
  bool holds(const Reach& other) const {
    const double more = kBeyond * (high - low);
    return other.low >= low - more && other.high <= high + more;
  }
};

// A run that was not made, as sure as the campaign's run of the nearest frequency.
struct Imagined {
  RunDatum datum;
  std::size_t like = 0;  // that run
};
Imagined imagined(const std::vector<RunDatum>& data, double frequency, double share) {
  const auto distance = [&](const RunDatum& d) {
    return std::fabs(std::log(d.frequency_hz / frequency));
  };
  const auto like = std::min_element(
      data.begin(), data.end(),
      [&](const RunDatum& a, const RunDatum& b) { return distance(a) < distance(b); });
  Imagined run;
  run.like = static_cast<std::size_t>(like - data.begin());
  run.datum.frequency_hz = frequency;
  run.datum.driver = VectorXd::Zero(3);
  run.datum.driver[1] = share * amplitude_of(*like);
  run.datum.response = VectorXd::Zero(like->response.size());
  set_covariance(run.datum, covariance_of(*like));
  run.datum.clock = like->clock;
  return run;
}

// What the parameters' covariance leaves open of a prediction.
MatrixXd open(const HarmonicFit& fit, const Prediction& prediction) {
  MatrixXd j(prediction.value().size(), static_cast<Index>(fit.free.size()));
  for (std::size_t k = 0; k < fit.free.size(); ++k)
    j.col(static_cast<Index>(k)) = prediction.jacobian().col(fit.free[k]);
  return j * fit.covariance * j.transpose();
}

// Of a run's solution, on its grid; nothing where it cannot be told.
VectorXd acceleration(const HarmonicFit& fit, std::size_t run) {
  PeriodicSystem system = fit.predictions[run].response()->anew();
  if (!system.linearise(fit.theta)) return {};
  VectorXd a(system.points());
  for (Index i = 0; i < a.size(); ++i)
    a[i] = system.acceleration(static_cast<int>(i), fit.model->observed());
  return a;
}

class Search {
 public:
  Search(const HarmonicFit& named, const std::vector<const HarmonicFit*>& indistinguishable,
         const std::vector<RunDatum>& data)
      : named_(named), indistinguishable_(indistinguishable), data_(data) {
    for (const Prediction& p : named.predictions)
      been_.add(*p.response(), named.model->observed());
  }

  DiscriminatingRun best_run() const {
    const auto [slowest, fastest] = std::minmax_element(
        data_.begin(), data_.end(),
        [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
    const double from = kSlower * slowest->frequency_hz;
    const double ratio = kFaster * fastest->frequency_hz / from;
    DiscriminatingRun best;
    Apart most;
    for (int i = 0; i < kFrequencies; ++i) {
      const double frequency = from * std::pow(ratio, static_cast<double>(i) / (kFrequencies - 1));
      for (const double share : kAmplitudes) {
        const Imagined run = imagined(data_, frequency, share);
        Prediction mine = of(named_, run);
        mine.start_from(named_.predictions[run.like]);
        if (!mine.at(named_.theta, HowFar::patient)) continue;
        // A larger one goes farther still.
        if (!within_reach(mine)) break;
        const Apart apart = separation_by(run, mine);
        if (!apart.better_than(most)) continue;
        most = apart;
        best = {frequency, amplitude_of(run.datum), {}, apart.nearest};
      }
    }
    return best;
  }

  // By the acceleration of the damper in the runs that were made.
  double by_accelerometer() const {
    Apart all;
    for (const HarmonicFit* rival : indistinguishable_) {
      double apart = 0.0, size = 0.0;
      for (std::size_t r = 0; r < data_.size(); ++r) {
        const VectorXd mine = acceleration(named_, r), theirs = acceleration(*rival, r);
        if (mine.size() != theirs.size()) continue;
        apart += (mine - theirs).squaredNorm();
        size += mine.squaredNorm();
      }
      if (size > 0.0) all.add(std::sqrt(apart / size) / kAccelerometer);
    }
    return all.nearest;
  }

 private:
  // From the rivals, in standard errors.
  struct Apart {
    double score = 0.0;    // enough is enough: how many it separates counts, not how far
    double nearest = 0.0;  // of those that it separates; 0: none
    bool better_than(const Apart& other) const {
      return nearest > 0.0 && std::tie(score, nearest) > std::tie(other.score, other.nearest);
    }
    void add(double separation) {
      score += std::min(separation, kSeparates);
      if (separation >= kSeparates)
        nearest = nearest == 0.0 ? separation : std::min(nearest, separation);
    }
  };

  // Corners are as round as in the run that it is like, for which theta was fitted.
  static Prediction of(const HarmonicFit& fit, const Imagined& run) {
    return {*fit.run_models[run.like], run.datum, fit.predictions[run.like].points()};
  }
  // Of about the stroke that has been made.
  bool within_reach(const Prediction& mine) const {
    Reach reach;
    reach.add(*mine.response(), named_.model->observed());
    return been_.holds(reach);
  }
  Apart separation_by(const Imagined& run, const Prediction& mine) const {
    Apart all;
    const MatrixXd own = open(named_, mine);
    for (const HarmonicFit* rival : indistinguishable_) {
      Prediction theirs = of(*rival, run);
      theirs.start_from(mine);
      if (!theirs.at(rival->theta, HowFar::patient)) continue;
      MatrixXd variance = covariance_of(run.datum) + own + open(*rival, theirs);
      if (run.datum.clock.size() > 0) variance += run.datum.clock * run.datum.clock.transpose();
      const VectorXd apart = mine.value() - theirs.value();
      all.add(std::sqrt(apart.dot(Ldlt(variance).solve(apart))));
    }
    return all;
  }

  const HarmonicFit& named_;
  const std::vector<const HarmonicFit*>& indistinguishable_;
  const std::vector<RunDatum>& data_;
  Reach been_;
};

bool periodic_response(const HarmonicFit& fit) {
  return std::all_of(fit.predictions.begin(), fit.predictions.end(),
                     [](const Prediction& p) { return p.response() != nullptr; });
}

}  // namespace

std::optional<DiscriminatingRun> discriminating_run(
    const HarmonicFit& named, const std::vector<const HarmonicFit*>& indistinguishable,
    const std::vector<RunDatum>& data) {
  if (indistinguishable.empty() || data.empty() || !periodic_response(named)) return {};
  const Search search(named, indistinguishable, data);
  DiscriminatingRun best = search.best_run();
  if (best.separation > 0.0) return best;
  const double by_channel = search.by_accelerometer();
  if (by_channel == 0.0) return {};
  return DiscriminatingRun{0.0, 0.0, "acceleration", by_channel};
}

}  // namespace shaker::estimator::diagnosis
