#include "estimator/diagnosis/records/internal/transient_seen.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// A record that goes on beyond its ends as if turned about them, so that a filter meets no jump.
class Filter {
 public:
  explicit Filter(Index samples, double dt) : n_(samples), dt_(dt) {
    in_.resize(static_cast<std::size_t>(4 * n_));
    out_.resize(in_.size());
  }

  template <class Transfer>
  VectorXd operator()(const VectorXd& y, const Transfer& transfer) {
    // Turned about its end it returns to its start: a whole period of four lengths.
    const double end = y[n_ - 1] + 0.5 * (y[n_ - 1] - y[n_ - 2]);
    for (Index i = 0; i < n_; ++i) {
      const double value = y[i] - end;
      at(i) = value;
      at(2 * n_ - 1 - i) = -value;
      at(2 * n_ + i) = -value;
      at(4 * n_ - 1 - i) = value;
    }
    fft_.fwd(out_.data(), in_.data(), 4 * n_);
    for (Index k = 0; k < 4 * n_; ++k) {
      const Index order = k <= 2 * n_ ? k : k - 4 * n_;
      const double omega = 2.0 * std::numbers::pi * static_cast<double>(order) /
                           (4.0 * static_cast<double>(n_) * dt_);
      const Complex factor = transfer(std::fabs(omega));
      out_[static_cast<std::size_t>(k)] *= omega < 0.0 ? std::conj(factor) : factor;
    }
    fft_.inv(in_.data(), out_.data(), 4 * n_);
    const double gain = transfer(0.0).real();
    VectorXd seen(n_);
    for (Index i = 0; i < n_; ++i)
      seen[i] = at(i).real() + gain * end;
    return seen;
  }

 private:
  Complex& at(Index i) { return in_[static_cast<std::size_t>(i)]; }

  Index n_;
  double dt_;
  Eigen::FFT<double> fft_;
  std::vector<Complex> in_, out_;
};

struct Stage {
  const Model::Term* term;
  std::vector<double> local;
  Index count;  // of own parameters
};

void filter(const Stage& stage, const SampledRun& run, Index first, SampledCourse& course) {
  VectorXd& samples = course.value;
  MatrixXd& slopes = course.slopes;
  const Instrument& instrument = *stage.term->effect->instrument();
  Filter through(samples.size(), run.dt);
  std::vector<Complex> d_theta(static_cast<std::size_t>(stage.count));
  const auto transfer = [&](double omega) {
    return instrument.transfer(omega, stage.local.data(), stage.term->constants.data(),
                               d_theta.data());
  };
  MatrixXd own(samples.size(), stage.count);
  for (Index k = 0; k < stage.count; ++k)
    own.col(k) = through(samples, [&](double omega) {
      transfer(omega);
      return d_theta[static_cast<std::size_t>(k)];
    });
  samples = through(samples, transfer);
  for (Index c = 0; c < slopes.cols(); ++c) {
    if (slopes.col(c).cwiseAbs().maxCoeff() > 0.0) slopes.col(c) = through(slopes.col(c), transfer);
  }
  slopes.middleCols(first + stage.term->first_parameter, stage.count) += own;
}

void point_by_point(const Stage& stage, const SampledRun& run, const SampledCourse& load,
                    Index first, SampledCourse& course) {
  const Index n = course.value.size();
  const Instrument& instrument = *stage.term->effect->instrument();
  VectorXd t(n), seen(n), slope(n), over_load = VectorXd::Zero(n);
  for (Index i = 0; i < n; ++i)
    t[i] = (static_cast<double>(i) + 0.5) * run.dt - 0.5 * run.length();
  MatrixXd own = MatrixXd::Zero(n, stage.count);
  std::vector<double*> columns;
  for (Index k = 0; k < stage.count; ++k)
    columns.push_back(own.col(k).data());
  const Signal at{static_cast<int>(n), course.value.data(), load.value.data(), t.data()};
  instrument.observe(at, stage.local.data(), stage.term->constants.data(),
                     {seen.data(), slope.data(), over_load.data(), columns.data()});
  course.value = seen;
  course.slopes = slope.asDiagonal() * course.slopes;
  if (instrument.sees_load()) course.slopes += over_load.asDiagonal() * load.slopes;
  course.slopes.middleCols(first + stage.term->first_parameter, stage.count) += own;
}

}  // namespace

void observe_samples(const Model& model, const std::vector<double>& theta, const SampledRun& run,
                     const SampledCourse& load, Index first_parameter,
                     SampledCourse& displacement) {
  for (const Model::Term& term : model.instruments()) {
    Stage stage{&term, std::vector<double>(kMostParameters, 0.0),
                static_cast<Index>(term.effect->parameters().size())};
    term.gather(theta.data(), stage.local.data());
    if (term.effect->instrument()->filters())
      filter(stage, run, first_parameter, displacement);
    else
      point_by_point(stage, run, load, first_parameter, displacement);
  }
}

}  // namespace shaker::estimator::diagnosis
