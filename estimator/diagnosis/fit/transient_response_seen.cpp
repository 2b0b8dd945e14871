// What the samples of a TransientResponse show.
#include <limits>
#include <vector>

#include "estimator/diagnosis/fit/internal/transient_response.hpp"
#include "estimator/diagnosis/records/internal/transient_load.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

SampledCourse TransientResponse::course_of(int state) const {
  const auto m = static_cast<std::size_t>(m_), k = static_cast<std::size_t>(m_ + p_);
  SampledCourse course{VectorXd(run_->samples()),
                       MatrixXd::Zero(run_->samples(), m_ + model_->parameter_count())};
  for (std::size_t a = 0; a < arcs_.size(); ++a) {
    const Arc& arc = arcs_[a];
    const bool last = a + 1 == arcs_.size();
    const std::size_t count = arc.times.size() - (last ? 0 : 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t node = i * m + static_cast<std::size_t>(state);
      const Eigen::RowVectorXd over = shooting_.row(a, &arc.sensitivities[node * k]);
      const auto at = static_cast<Index>(first_[a] + i);
      course.value[at] = arc.states[node] - over[m_ + p_];
      course.slopes.row(at).head(m_) = over.head(m_);
      for (int c = 0; c < p_; ++c)
        course.slopes(at, m_ + free_[static_cast<std::size_t>(c)]) = over[m_ + c];
    }
  }
  return course;
}

SampledCourse TransientResponse::load_along(const std::vector<double>& theta) const {
  MatrixXd states(run_->samples(), m_);
  std::vector<MatrixXd> slopes;
  for (int j = 0; j < m_; ++j) {
    SampledCourse course = course_of(j);
    states.col(j) = course.value;
    slopes.push_back(std::move(course.slopes));
  }
  const auto load = transient_load(equations_, theta, run_->excitation, states);
  if (!load)
    return {VectorXd::Constant(states.rows(), std::numeric_limits<double>::quiet_NaN()),
            MatrixXd::Zero(states.rows(), slopes.front().cols())};
  SampledCourse course{load->value, MatrixXd::Zero(states.rows(), slopes.front().cols())};
  for (int j = 0; j < m_; ++j)
    course.slopes += load->over_states.col(j).asDiagonal() * slopes[static_cast<std::size_t>(j)];
  for (const int parameter : free_)
    course.slopes.col(m_ + parameter) += load->over_parameters.col(parameter);
  return course;
}

bool TransientResponse::see(const std::vector<double>& theta) {
  const SampledCourse load = sees_load(*model_) ? load_along(theta) : SampledCourse{};
  seen_ = course_of(model_->observed());
  observe_samples(*model_, theta, *run_, load, m_, seen_);
  return seen_.value.allFinite() && seen_.slopes.allFinite();
}

}  // namespace shaker::estimator::diagnosis
