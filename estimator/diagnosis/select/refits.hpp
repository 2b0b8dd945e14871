// Hypotheses made: the base model with effects added, fitted in full.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/smoothing.hpp"
#include "estimator/diagnosis/score/candidates.hpp"
#include "estimator/diagnosis/select/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

// What the data's errors are made of.
enum class Errors {
  noise,
  residual  // what the best of a first search left besides: that of a corner is small beside it
};

// Its arguments must outlive it.
class Refits {
 public:
  Refits(const HarmonicFit& base, const std::vector<RunDatum>& data, const FitOptions& options,
         Errors errors = Errors::noise)
      : base_(base), data_(data), options_(options), errors_(errors) {}

  // One more effect, or one less; with the evidence for it.
  Hypothesis with(const Hypothesis& smaller, const Probe& probe) const;
  // The effect alone, begun where it is at work; nothing when a few steps from there do not come
  // below `most`.
  std::optional<Hypothesis> elsewhere(const Probe& probe, double most) const;
  // The line of an added effect that the fit has switched off: what is left is the set without it.
  std::optional<std::size_t> switched_off(const Hypothesis& h) const;
  Hypothesis without(const Hypothesis& larger, std::size_t line) const;
  // With the simpler effect in the place of the richer one that holds it, from there.
  Hypothesis with_simpler(const Hypothesis& richer, const std::string& effect,
                          const config::EffectSpec& simpler) const;
  // One that was fitted to other errors of the same runs, from where it was.
  Hypothesis again(const Hypothesis& known) const;
  // Evidence and cross-validation of what has been fitted.
  void describe(Hypothesis& h) const;
  // The place of rest of an effect that others have joined since, fitted again. False when there is
  // none, or nothing to gain.
  bool recentred(Hypothesis& h) const;
  // Corners made as sharp as fine grids allow, or as wide as the data have them; `hopeless`: only
  // if they may lead below so much of chi-squared. False when there is no corner, or where finer
  // grids change nothing or do not settle.
  bool sharpened(Hypothesis& h, double hopeless = std::numeric_limits<double>::infinity()) const;
  // Where shares of a gap are weighed, finer grids do for that; this takes one that they have
  // sharpened to no width, where that leaves less and stays admissible.
  void finish_sharpening(Hypothesis& h) const;

 private:
  std::shared_ptr<const HarmonicFit> as_stated(const Hypothesis& h) const;
  std::shared_ptr<const HarmonicFit> as_data_say(const Hypothesis& h, const HarmonicFit* at_once,
                                                 const HarmonicFit* stated) const;
  void sharpen_as(const Hypothesis& known, Hypothesis& h) const;
  std::optional<Sharpened> to_limit(const HarmonicFit& round, const Sharpening& worth) const;
  bool gentle(const Hypothesis& h, const HarmonicFit& stated) const;
  bool richer_does_it(const Hypothesis& h, const HarmonicFit& fit) const;
  bool resolved(Hypothesis& h) const;
  // `data`: null: as given.
  void sharpened_to(Hypothesis& h, std::shared_ptr<const HarmonicFit> fit,
                    std::shared_ptr<const std::vector<RunDatum>> data) const;
  void finish(Hypothesis& h) const;
  void judge(Hypothesis& h) const;
  // Where a line's force has a place of rest that the model file does not give, that place is
  // fitted too (centring.cpp).
  void centre(Hypothesis& h, std::size_t line) const;
  std::shared_ptr<const HarmonicFit> about(const HarmonicFit& fit, std::size_t line, double place,
                                           const std::vector<double>& theta, int iterations) const;
  std::shared_ptr<const HarmonicFit> refitted(const config::ModelSpec& spec,
                                              const std::vector<double>& start,
                                              const HarmonicFit* near) const;
  std::shared_ptr<const HarmonicFit> begun_apart(std::shared_ptr<const HarmonicFit> best,
                                                 const HarmonicFit& parent,
                                                 const Probe& probe) const;
  FitOptions options_for(const config::ModelSpec& spec) const;
  std::size_t first_added() const { return base_.spec.effects.size(); }

  const HarmonicFit& base_;
  const std::vector<RunDatum>& data_;
  const FitOptions& options_;
  const Errors errors_;
};

}  // namespace shaker::estimator::diagnosis
