// Makes hypotheses: fits the base model with added effects in full.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"
#include "estimator/diagnosis/select/internal/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

// What the errors of the data consist of.
enum class Errors {
  noise,
  residual  // what the best of a first search left besides: that of a corner is small beside it
};

// Number of standard errors by which a parameter of a fit would go on, over a bound or after no step, with
// all other parameters following.
double pull(const HarmonicFit& fit, const std::vector<RunDatum>& data, int parameter);

// The arguments of the constructor must outlive the object.
class Refits {
 public:
  Refits(const HarmonicFit& base, const std::vector<RunDatum>& data, const FitOptions& options,
         Errors errors = Errors::noise)
      : base_(base), data_(data), options_(options), errors_(errors) {}

  // Tells what an admissible hypothesis leaves: fits that come nowhere near it are given up.
  void know_left(const Hypothesis& h);
  // Fits a hypothesis with one more effect, and computes its evidence.
  Hypothesis with(const Hypothesis& smaller, const Probe& probe) const;
  // Fits the base model with the effect from start values at which the effect acts. Empty if a few
  // steps from there do not come below a chi-squared of `most`.
  std::optional<Hypothesis> elsewhere(const Probe& probe, double most) const;
  // Returns the line of an added effect that the fit has switched off; without() removes it.
  std::optional<std::size_t> switched_off(const Hypothesis& h) const;
  Hypothesis without(const Hypothesis& larger, std::size_t line) const;
  // Replaces an effect by one that holds it as a special case, or by its special case, and fits
  // again from there.
  Hypothesis with_instead(const Hypothesis& known, const std::string& effect,
                          const config::EffectSpec& other) const;
  // Fits a hypothesis again that was fitted to other errors of the same runs, from its parameters.
  Hypothesis again(const Hypothesis& known) const;
  // Computes evidence and cross-validation of the present fit.
  void describe(Hypothesis& h) const;
  // Refits with smoothing as narrow as finer grids allow, or as wide as the data show. Gives up
  // early if that cannot lead below a chi-squared of `hopeless`. Returns false if there is no
  // corner, or if finer grids change nothing or do not converge.
  bool narrowed(Hypothesis& h, double hopeless = std::numeric_limits<double>::infinity()) const;
  // A search by shares of the gap stops at the finer grids. This takes their result to zero width,
  // if that leaves less and stays admissible.
  void finish_narrowing(Hypothesis& h) const;

 private:
  std::shared_ptr<const HarmonicFit> as_stated(const Hypothesis& h) const;
  std::shared_ptr<const HarmonicFit> as_data_say(const Hypothesis& h, const HarmonicFit* at_once,
                                                 const HarmonicFit* stated) const;
  void narrow_as(const Hypothesis& known, Hypothesis& h) const;
  std::optional<ZeroWidthFit> to_limit(const std::shared_ptr<const HarmonicFit>& round,
                                       const ZeroWidthOptions& worth) const;
  bool gentle(const Hypothesis& h, const HarmonicFit& stated) const;
  bool richer_does_it(const Hypothesis& h, const HarmonicFit& fit) const;
  bool resolved(Hypothesis& h) const;
  // `data` may be null: then the fit is to the data of the constructor.
  void set_narrowed(Hypothesis& h, std::shared_ptr<const HarmonicFit> fit,
                    std::shared_ptr<const std::vector<RunDatum>> data) const;
  void finish(Hypothesis& h) const;
  void judge(Hypothesis& h) const;
  // Fits the place of rest of a force too, where the data tell it from zero (centring.cpp).
  void centre(Hypothesis& h, std::size_t line) const;
  bool rests_elsewhere(const HarmonicFit& fit, std::size_t line, const PlacesOfRest& within) const;
  std::shared_ptr<const HarmonicFit> refitted(const config::ModelSpec& spec,
                                              const std::vector<double>& start,
                                              const HarmonicFit* near) const;
  std::shared_ptr<const HarmonicFit> begun_at_forces(const config::ModelSpec& spec,
                                                     const HarmonicFit& parent) const;
  std::shared_ptr<const HarmonicFit> begun_apart(std::shared_ptr<const HarmonicFit> best,
                                                 const HarmonicFit& parent,
                                                 const Probe& probe) const;
  FitOptions options_for(const config::ModelSpec& spec) const;
  std::size_t first_added() const { return base_.spec.effects.size(); }

  const HarmonicFit& base_;
  const std::vector<RunDatum>& data_;
  const FitOptions& options_;
  const Errors errors_;
  double least_left_ = std::numeric_limits<double>::infinity();  // chi-squared
};

}  // namespace shaker::estimator::diagnosis
