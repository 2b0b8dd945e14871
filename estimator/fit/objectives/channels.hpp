// Estimation from several measured channels: displacement, acceleration of the mass, load.
//
// Let E be the n x m residuals of m channels at n points, M = E^T E (3.12), and V the covariance of
// the errors at one point, equal at all points. Then -2 ln L is, without constants,
//
//     known V          tr(V^-1 M)                                              (3.15)
//     independent      n sum over channels of ln M_bb,    V_bb = M_bb / n      (3.13)
//     joint            n ln det M,                        V = M / n            (3.11)
//
// V is eliminated from the last two. The units of a channel do not affect the estimate, and the
// weight of a channel follows from its own noise. The joint form counts an error that two channels
// share (a cable, a table that shakes both) only once; it needs channels that are measured at the
// same times. A mean of several cycles has V / cycles, and the scatter of the single cycles about
// it is information on V too: M = sum over runs of cycles * E^T E + scatter.
//
// The paper has two methods with the same optimum. In the first, V follows every step of theta (the
// gradient of the eliminated form is that of (3.15) at the present V). The second is stagewise
// (Bard 1974): theta converges for each V. Priors of the model count as in (3.8). The reported
// noise is corrected for the number of parameters (each channel loses the share that it
// determines), and theta's covariance is (3.27) with it.
//
// The periodic solutions converge at every theta (nested). Use it from one thread; it allocates.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/model/instrument/observation.hpp"

namespace shaker::estimator {

struct ChannelRun {
  double frequency_hz = 0.0;
  double amplitude = 0.0;          // of a pure cosine; unused when `excitation` is given
  std::vector<double> excitation;  // one period on equal steps, model's length unit / s^2
  std::vector<double> tau;         // cyclic times of all channels; empty: equal steps
  std::vector<std::vector<double>> channels;  // one series for each quantity, of equal length
  double cycles = 1.0;                        // number of averaged cycles
  // Sum over cycles and points of the products of the single cycles' deviations from the mean,
  // m x m, row by row; empty: none. It counts as (cycles - 1) times the points of the run.
  std::vector<double> scatter;
  // Standard error of the cosine and sine parts of the measured excitation's harmonics, as in
  // RunData. It changes all channels together and widens theta's covariance. 0: known exactly.
  double excitation_error = 0.0;
  // As in RunData: what differs from run to run, and the run's own model. Null: the model of all.
  config::RunCondition condition = {};
  std::shared_ptr<const Model> model = {};
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
  std::vector<double> likely_covariance;  // m x m: V that maximises the likelihood
  std::vector<double> noise_covariance;   // the same, corrected for the number of parameters
  double log_likelihood = 0.0;            // with constants
  int stages = 0;                         // changes of V
};

// Fits the model to the runs from `start` (all parameters). Throws std::invalid_argument with an
// explanation for data that cannot be used; other failures are reported in ChannelFit::fit.
ChannelFit fit_channels(const Model& model, std::span<const Quantity> quantities,
                        std::vector<ChannelRun> runs, const std::vector<double>& start,
                        const ChannelOptions& options = {});

}  // namespace shaker::estimator
