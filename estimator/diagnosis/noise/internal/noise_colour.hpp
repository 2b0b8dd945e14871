// The colour of a record's noise, which the spectrum above the response does not show.
//
// The residual of a fit is either noise or a missing force. Noise does not depend on the motion.
// The residual is therefore taken for noise of any colour if neither an effect of the catalogue nor
// a smooth force over stroke and velocity correlates with it more than chance allows.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Which noise has the unknown spectrum. Noise of the measured excitation has the covariance of the
// response to it (excitation_noise.hpp).
enum class ColourOf { response, excitation };

// Returns the data with the spectrum of the residual of `fit` as their noise, in bands that widen
// with frequency. No variance becomes smaller than it was. `fitted`: the data of the fit.
std::vector<RunDatum> with_spectrum_left(const HarmonicFit& fit,
                                         const std::vector<RunDatum>& fitted,
                                         const std::vector<RunDatum>& data, ColourOf of);

// A fit and the data of which its residual is taken.
struct ResidualOf {
  const HarmonicFit& fit;
  const std::vector<RunDatum>& data;
};
// Twice the logarithm by which the residual spectrum of `one` is more probable than that of `other`
// (Whittle's likelihood in those bands, over the fitted runs). For two fits that leave the same
// noise it is about the difference of their numbers of parameters.
double spectrum_gain(const ResidualOf& one, const ResidualOf& other);

// Probability that noise correlates with the responses to a smooth force over stroke and velocity
// as much as the residual of `fit` does (Fisher's F; the rest of the residual is the size of the
// noise). Empty if such a force cannot be added to the model.
std::optional<double> chance_along_motion(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                          const FitOptions& options);

// True if the residual of `fit` is small enough to be noise: in every run at most a tenth of the
// response without its mean.
bool may_be_noise(const HarmonicFit& fit, const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
