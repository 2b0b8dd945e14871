// The colour of a record's noise, which its spectrum above the response does not tell.
//
// What a fit leaves of a record is either noise or a force that the model lacks. Noise knows
// nothing of the motion; so what is left is taken for noise, of whatever colour it has, where
// neither an effect of the catalogue nor any smooth force over stroke and velocity lies along it
// more than chance would.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Of which noise the spectrum is not known. That of the measured excitation has the response's
// covariance (excitation_noise.hpp), whatever its size.
enum class ColourOf { response, excitation };

// The data with noise of the spectrum that `fit` leaves, in bands that widen with frequency;
// nowhere less than the noise that they had. `fitted`: those that it was fitted to.
std::vector<RunDatum> with_spectrum_left(const HarmonicFit& fit,
                                         const std::vector<RunDatum>& fitted,
                                         const std::vector<RunDatum>& data, ColourOf of);

// Logarithm by which the spectrum that `one` leaves is more probable than that of `other`, doubled
// (Whittle's likelihood, in those bands): of two fits that leave the same noise about the number of
// parameters that one has more. Of the runs that were fitted.
double spectrum_gain(const HarmonicFit& one, const HarmonicFit& other,
                     const std::vector<RunDatum>& data);

// Probability that noise with the data's errors lies as much along the responses to a smooth force
// over stroke and velocity as what `fit`, fitted to them, leaves does (Fisher's F, the noise's size
// being what is left beside them). Nothing where such a force cannot be added to the model.
std::optional<double> chance_along_motion(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                          const FitOptions& options);

// Whether what `fit` leaves of its runs may be noise, as far as its size says. False where a run
// leaves more than a tenth of its response, without the mean.
bool may_be_noise(const HarmonicFit& fit, const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
