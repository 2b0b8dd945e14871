#include "estimator/diagnosis/records/internal/transient_run.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/record_checks.hpp"
#include "estimator/diagnosis/records/internal/record_parts.hpp"
#include "estimator/diagnosis/records/internal/spectral_floor.hpp"
#include "estimator/diagnosis/records/internal/telling_stretches.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kFewest = 32;  // samples
constexpr double kEven = 0.05;       // of a step: stamps are rounded
constexpr double kSteps = 5.0;       // samples in the shortest period that is kept
constexpr Index kEndSamples = 5;     // for a slope at an end
constexpr int kPointsPerSample = 4;  // of the excitation's course
// Of an excitation's power over that of its noise: below it, its spectrum has no floor that could
// be told from itself.
constexpr double kDistinct = 30.0;

bool imposed(const Recording& r) {
  return r.kind == Kind::imposed_motion;
}

// Of a record's median step: something that sticks at its extreme eases into it by less.
constexpr double kEases = 0.05;

// Stays on its extreme value in mid-motion: the curve comes in and leaves by steps that are large
// against the smallest that it takes, which a crest does not.
bool clipped(const std::vector<double>& y, bool top) {
  const double sign = top ? 1.0 : -1.0;
  double extreme = sign * y.front();
  std::vector<double> steps;
  for (std::size_t i = 0; i < y.size(); ++i) {
    extreme = std::max(extreme, sign * y[i]);
    if (i > 0 && y[i] != y[i - 1]) steps.push_back(std::fabs(y[i] - y[i - 1]));
  }
  if (steps.empty()) return false;
  const double smallest = std::ranges::min(steps);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  const double least = std::max(5.0 * smallest, kEases * *middle);
  std::size_t first = 0, length = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (sign * y[i] == extreme) {
      if (length++ == 0) first = i;
      continue;
    }
    if (length >= 5 && first > 0 &&
        std::min(extreme - sign * y[first - 1], extreme - sign * y[i]) > least)
      return true;
    length = 0;
  }
  return false;
}

Result<void> check(const Recording& r) {
  if (r.t.size() < kFewest)
    return unfit(
        r, fmt::format("{} samples are too few; at least {} are needed", r.t.size(), kFewest));
  if (auto good = check_times(r); !good) return good;
  if (auto good = check_column(r, r.displacement, "displacement"); !good) return good;
  if (!(range_of(r.displacement) > 0.0)) return unfit(r, "the displacement never changes");
  if (imposed(r)) {
    if (auto good = check_column(r, r.force, "force"); !good) return good;
    if (!(range_of(r.force) > 0.0)) return unfit(r, "the force never changes");
  } else if (!r.excitation.empty()) {
    if (auto good = check_column(r, r.excitation, "excitation"); !good) return good;
    if (!(range_of(r.excitation) > 0.0) && r.excitation.front() != 0.0)
      return unfit(r,
                   fmt::format("the excitation never changes from {:.4g}: the channel is dead; for "
                               "a free decay or a drop leave the column out",
                               r.excitation.front()));
  }
  const auto reject = [&](const char* name, bool top) {
    return unfit(r, clipped_sentence(name, top));
  };
  for (const bool top : {true, false}) {
    if (clipped(r.displacement, top)) return reject("displacement", top);
    if (imposed(r) && clipped(r.force, top)) return reject("force", top);
  }
  return {};
}

// The columns on an even clock of a length that transforms fast.
struct Even {
  double start = 0.0, dt = 0.0;
  VectorXd displacement, other;  // other: excitation or force; may be empty
  bool interpolated = false;
};

Even on_even_clock(const Recording& r) {
  const auto n = static_cast<Index>(r.t.size());
  Even even;
  even.dt = (r.t.back() - r.t.front()) / static_cast<double>(n - 1);
  double worst = 0.0;
  for (Index i = 0; i < n; ++i)
    worst = std::max(worst, std::fabs(r.t[static_cast<std::size_t>(i)] - r.t.front() -
                                      even.dt * static_cast<double>(i)));
  even.interpolated = worst > kEven * even.dt + 0.6e-3 * even.dt;
  const auto& other = imposed(r) ? r.force : r.excitation;
  const bool driven = imposed(r) || (!other.empty() && range_of(other) > 0.0);
  const Index length = fast_length(n);
  even.start = r.t.front() - 0.5 * even.dt;
  const auto column = [&](const std::vector<double>& values) -> VectorXd {
    if (!even.interpolated) return Eigen::Map<const VectorXd>(values.data(), length);
    const Excitation curve = Excitation::sampled(r.t, values);
    VectorXd out(length);
    for (Index i = 0; i < length; ++i)
      out[i] = curve.value(r.t.front() + even.dt * static_cast<double>(i));
    return out;
  };
  even.displacement = column(r.displacement);
  if (driven) even.other = column(other);
  return even;
}

// A curve as a parabola with its slopes at the ends, and cosines of what is left: without the
// parabola the ends' slopes would leak into all of them.
struct Curve {
  double slope = 0.0, bend = 0.0, length = 0.0;  // of bend t^2 / 2 + slope t
  VectorXd series;
};

double end_slope(const VectorXd& y, Index first, Index at, double dt) {
  // Of the parabola through kEndSamples samples, at sample `at`.
  MatrixXd a(kEndSamples, 3);
  for (Index i = 0; i < kEndSamples; ++i) {
    const auto x = static_cast<double>(first + i - at);
    a.row(i) << 1.0, x, x * x;
  }
  const VectorXd c = least_squares(a, VectorXd(y.segment(first, kEndSamples)));
  return c[1] / dt;
}

double trend(const Curve& c, double t, int order) {
  if (order == 0) return t * (c.slope + 0.5 * c.bend * t);
  return order == 1 ? c.slope + c.bend * t : c.bend;
}

// Before sample `border`, from four samples on either side where there are as many: a cut through the
// midst of a record.
double border_slope(const VectorXd& y, Index border, double dt) {
  constexpr double kWeights[] = {1225.0 / 1024, -245.0 / 3072, 49.0 / 5120, -5.0 / 7168};
  constexpr Index kSide = 4;
  if (border < kSide) return end_slope(y, 0, 0, dt);
  if (border + kSide > y.size()) return end_slope(y, y.size() - kEndSamples, y.size() - 1, dt);
  double sum = 0.0;
  for (Index k = 0; k < kSide; ++k)
    sum += kWeights[k] * (y[border + k] - y[border - 1 - k]);
  return sum / dt;
}

Curve curve_of(const VectorXd& y, Stretch stretch, double dt) {
  Curve c;
  const Index n = stretch.length;
  c.length = dt * static_cast<double>(n);
  c.slope = border_slope(y, stretch.begin, dt);
  c.bend = (border_slope(y, stretch.begin + n, dt) - c.slope) / c.length;
  VectorXd rest = y.segment(stretch.begin, n);
  for (Index i = 0; i < n; ++i)
    rest[i] -= trend(c, dt * (static_cast<double>(i) + 0.5), 0);
  c.series = CosineTransform(n).analyse(rest, n);
  return c;
}

// On n steps, what lies above the first `keep` cosines left out.
VectorXd sampled(const Curve& c, const CosineTransform& grid, Index keep, int order) {
  const VectorXd few = c.series.head(std::min({keep, c.series.size(), grid.samples()}));
  VectorXd y = grid.synthesise(few, order, c.length);
  const double dt = c.length / static_cast<double>(grid.samples());
  for (Index i = 0; i < y.size(); ++i)
    y[i] += trend(c, dt * (static_cast<double>(i) + 0.5), order);
  return y;
}

double size_of(const VectorXd& y) {
  return std::sqrt((y.array() - y.mean()).square().mean());
}

struct Prepared {
  Even even;
  Curve motion, other;
  SpectralFloor motion_floor, other_floor;
};

Prepared prepare(const Even& whole, Stretch stretch) {
  Prepared p;
  p.even = whole;
  p.even.start += whole.dt * static_cast<double>(stretch.begin);
  p.even.displacement = whole.displacement.segment(stretch.begin, stretch.length);
  p.motion = curve_of(whole.displacement, stretch, whole.dt);
  p.motion_floor = trend_floor(p.motion.series, size_of(p.even.displacement));
  if (whole.other.size() > 0) {
    p.even.other = whole.other.segment(stretch.begin, stretch.length);
    p.other = curve_of(whole.other, stretch, whole.dt);
    p.other_floor = trend_floor(p.other.series, size_of(p.even.other));
  }
  return p;
}

// Empty where the excitation reaches up to half the sampling rate, or falls as evenly as a noise
// does.
VectorXd excitation_noise(const Prepared& p, Index samples) {
  const SpectralFloor& floor = p.other_floor;
  if (!floor.reached || p.other.series.squaredNorm() < kDistinct * floor.power.sum()) return {};
  const Index count = std::min(samples, floor.power.size());
  return upper_power(floor).head(count);
}

// Samples that carry the motion; what the excitation does above it moves nothing.
Index samples_for(const Prepared& p) {
  const auto n = p.even.displacement.size();
  const auto wanted = static_cast<Index>(kSteps / 2.0 * static_cast<double>(p.motion_floor.band));
  if (wanted >= n) return n;
  Index few = std::max<Index>(wanted, 64);
  while (few < n && fast_length(few) != few)
    ++few;
  return std::min(few, n);
}

using Sampled = std::shared_ptr<SampledRun>;

Sampled sampled_run(const std::string& name, const Recording& r, Prepared p) {
  auto run = std::make_shared<SampledRun>();
  run->name = name;
  run->kind = r.kind;
  run->role = r.role;
  run->condition = r.condition;
  if (p.even.interpolated)
    run->notes.push_back(fmt::format(
        "run {}: its samples are not evenly spaced and were put on an even clock of {:.4g} s", name,
        p.even.dt));
  const bool force = r.kind == Kind::imposed_motion;
  const Index n = samples_for(p);
  const Index raw = p.even.displacement.size();
  if (n < 9 * raw / 10)
    run->notes.push_back(
        fmt::format("run {}: {} samples were decimated to {}: nothing moves above {:.4g} Hz", name,
                    raw, n, 0.5 * static_cast<double>(p.motion_floor.band) / p.motion.length));
  const CosineTransform grid(n);
  run->start = p.even.start;
  run->dt = p.motion.length / static_cast<double>(n);
  run->u = sampled(p.motion, grid, p.motion_floor.band, 0);
  run->v = sampled(p.motion, grid, p.motion_floor.band, 1);
  run->a = sampled(p.motion, grid, p.motion_floor.band, 2);
  if (force)
    run->response = sampled(p.other, grid, n, 0);
  else
    run->response = sampled(p.motion, grid, n, 0);
  if (!force && p.even.other.size() > 0) {
    run->excitation = sampled(p.other, grid, n, 0);
    run->excitation_noise = excitation_noise(p, n);
  }
  const SpectralFloor& floor = force ? p.other_floor : p.motion_floor;
  run->keep = std::min(n, floor.band);
  run->variance = floor.power.head(run->keep);
  run->freedom = VectorXd::Constant(run->keep, floor.freedom);
  run->motion_noise = p.motion_floor.power.head(run->keep);
  run->sample_noise = 0.5 * p.motion_floor.power.sum();
  if (!floor.reached)
    run->notes.push_back(fmt::format(
        "run {}: the {} reaches up to half of the sampling rate, so that its noise "
        "cannot be told from it there: the noise floor may be overstated; sample faster",
        name, force ? "force" : "displacement"));
  return run;
}

// A long part of a record as several runs, one a stretch.
std::vector<Sampled> sampled_stretches(const Recording& r, const std::string& record,
                                       Index most_samples) {
  const Even even = on_even_clock(r);
  const Index all = even.displacement.size();
  Prepared whole = prepare(even, {0, all});
  const Index n = samples_for(whole);
  if (n <= most_samples) return {sampled_run(r.name, r, std::move(whole))};
  const auto share = static_cast<double>(most_samples) / static_cast<double>(n);
  std::vector<Sampled> runs;
  std::string used;
  for (const Stretch& stretch : telling_stretches(even.displacement, share)) {
    const auto at = [&](Index i) { return r.t.front() + even.dt * static_cast<double>(i); };
    const std::string span =
        fmt::format("{:.4g} to {:.4g} s", at(stretch.begin), at(stretch.begin + stretch.length));
    used += (used.empty() ? "" : ", ") + span;
    runs.push_back(sampled_run(fmt::format("{} ({})", record, span), r, prepare(even, stretch)));
  }
  runs.front()->notes.insert(
      runs.front()->notes.begin(),
      fmt::format(
          "run {}: of its {:.4g} s these are used, where it moves much and little: {}; the whole "
          "would take long",
          r.name, r.t.back() - r.t[0], used));
  return runs;
}

// A record as several runs where samples are missing in it, or where it is long.
// `of_run`: most samples of it.
Result<std::vector<Sampled>> runs_of(const Recording& r, Index of_run) {
  if (auto good = check(r); !good) return good.error();
  RecordParts found = parts_between_gaps(r, kFewest);
  std::size_t samples = 0;
  for (const Recording& part : found.parts)
    samples += part.t.size();
  if (samples == 0)
    return unfit(
        r,
        fmt::format("samples are missing at so many places that no {} follow each other", kFewest));
  std::vector<Sampled> runs;
  for (const Recording& part : found.parts) {
    const auto most = static_cast<Index>(part.t.size() * std::size_t(of_run) / samples);
    for (Sampled& run : sampled_stretches(part, r.name, most))
      runs.push_back(std::move(run));
  }
  for (const Sampled& run : runs)
    run->record = r.name;
  auto& notes = runs.front()->notes;
  notes.insert(notes.begin(), found.notes.begin(), found.notes.end());
  return runs;
}

}  // namespace

Result<SampledRuns> sampled_runs(const std::vector<Recording>& runs,
                                 const SamplingOptions& options) {
  SampledRuns all;
  std::string first_trouble;
  Index fitted = 0;
  const Index along_motion =
      options.most_along_motion / std::max<Index>(1, static_cast<Index>(runs.size()));
  for (const Recording& recording : runs) {
    auto sampled = runs_of(recording, recording.kind == Kind::imposed_motion
                                          ? std::max(options.most_samples, along_motion)
                                          : options.most_samples);
    if (!sampled && sampled.error().kind == ErrorKind::invalid) return sampled.error();
    if (!sampled) {
      if (first_trouble.empty()) first_trouble = sampled.error().what;
      all.left_out.push_back(sampled.error().what + " (this run is left out)");
      continue;
    }
    for (Sampled& run : *sampled) {
      fitted += run->role == Role::fit ? 1 : 0;
      all.runs.push_back(std::move(run));
    }
  }
  if (fitted == 0) return Error{ErrorKind::not_converged, "no run can be used: " + first_trouble};
  const Index share = options.most_cosines / std::max<Index>(1, fitted);
  for (const auto& run : all.runs) {
    if (run->keep <= share) continue;
    run->keep = share;
    run->variance.conservativeResize(share);
    run->freedom.conservativeResize(share);
    run->motion_noise.conservativeResize(share);
    run->notes.push_back(fmt::format(
        "run {}: frequencies above {:.4g} Hz are not compared: all runs together would take long",
        run->name, run->highest_frequency()));
  }
  return all;
}

Excitation excitation_of(const SampledRun& run) {
  if (run.excitation.size() == 0) return {};
  const Index n = run.samples();
  // Its ends' slopes taken out, so that the series converges.
  const double slope = (run.excitation[1] - run.excitation[0]);
  const double bend = (run.excitation[n - 1] - run.excitation[n - 2] - slope) / double(n);
  VectorXd rest = run.excitation;
  const auto trend = [&](double i) { return i * (slope + 0.5 * bend * i); };
  for (Index i = 0; i < n; ++i)
    rest[i] -= trend(static_cast<double>(i) + 0.5);
  const VectorXd series = CosineTransform(n).analyse(rest, n);
  const VectorXd fine = CosineTransform(kPointsPerSample * n).synthesise(series);
  std::vector<double> t, x;
  for (Index i = 0; i < kPointsPerSample * n; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / kPointsPerSample;
    t.push_back(at * run.dt);
    x.push_back(fine[i] + trend(at));
  }
  return Excitation::sampled(t, x);
}

}  // namespace shaker::estimator::diagnosis
