// Several measured channels at once: displacement, acceleration of the mass, load.
//
// With E the n x m residuals of m channels at n points, M = E^T E (3.12), and V the covariance of
// one point's errors, the same at all points, -2 ln L is (constants left out)
//
//     known V          tr(V^-1 M)                                              (3.15)
//     independent      n sum over channels of ln M_bb,    V_bb = M_bb / n      (3.13)
//     joint            n ln det M,                        V = M / n            (3.11)
//
// the last two with V eliminated. A channel in other units changes nothing in them, and a poor
// sensor counts for as little as it is worth, without anyone saying so. Errors that two channels
// share (a cable, a table that shakes both) count once in the joint form; it needs the channels to
// be measured at the same times. Means of several cycles have V / cycles, and the scatter of the
// single cycles about them tells of V as well: M = sum over runs of cycles * E^T E + scatter.
//
// Two ways to the same optimum, both of the paper: all at once, V following every step of theta
// (the gradient of the eliminated form is that of (3.15) at the present V), or stagewise (Bard
// 1974), theta to the end for each V. Priors of the model count as in (3.8). Reported noise is
// corrected for the parameters (each channel loses the share of them that it determines), theta's
// covariance is (3.27) with it.
//
// Nested: the periodic solutions are converged at every theta. One thread; allocates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "estimator/estimation.hpp"
#include "estimator/instrument/observation.hpp"

namespace shaker::estimator {

struct ChannelRun {
  double frequency_hz = 0.0;
  double amplitude = 0.0;          // of a pure cosine; not used when `excitation` is given
  std::vector<double> excitation;  // one period on equal steps
  std::vector<double> tau;         // cyclic times of all channels; empty: equal steps
  std::vector<std::vector<double>> channels;  // as many series of the same length as quantities
  double cycles = 1.0;                        // averaged
  // Sum over cycles and points of the products of single cycles' errors about the mean, m x m, row
  // by row; empty: none. It stands for (cycles - 1) times as many points as the run has.
  std::vector<double> scatter;
  // Standard error of the cosine and sine parts of the measured excitation's harmonics, as in
  // RunData: it moves all channels together and widens theta's covariance. 0: known exactly.
  double excitation_error = 0.0;
};

enum class NoiseModel { known, independent, joint };

struct ChannelOptions {
  NoiseModel noise = NoiseModel::independent;
  std::vector<double> known_covariance;  // m x m, row by row, of one sample; for `known`
  bool stagewise = false;
  GridOptions grid{Scheme::order6, 160, true};
  int max_iterations = 100;
  double tolerance = 1e-9;
  int excitation_harmonics = 8;
  double confidence = 0.95;
};

struct ChannelFit {
  Fit fit;                                // `noise`, `sum_of_squares`: of the first channel
  std::vector<double> likely_covariance;  // V at the optimum, m x m: what maximises the likelihood
  std::vector<double> noise_covariance;   // the same, corrected for the parameters
  double log_likelihood = 0.0;            // constants included
  int stages = 0;                         // changes of V
};

// Throws std::invalid_argument with a sentence for data that cannot be used.
ChannelFit fit_channels(const Model& model, std::span<const Quantity> quantities,
                        std::vector<ChannelRun> runs, const std::vector<double>& start,
                        const ChannelOptions& options = {});

}  // namespace shaker::estimator
