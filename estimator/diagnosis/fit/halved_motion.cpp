#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;

Motion halved(const Motion& m) {
  const Index n = m.u.size();
  const double h = m.dt;
  Motion fine{0.5 * h, VectorXd(2 * n), VectorXd(2 * n), VectorXd(2 * n), VectorXd(), m.periodic};
  if (m.x.size() > 0) fine.x.resize(2 * n);
  for (Index i = 0; i < n; ++i) {
    fine.u[2 * i] = m.u[i];
    fine.v[2 * i] = m.v[i];
    fine.a[2 * i] = m.a[i];
    const Index next = i + 1 < n ? i + 1 : m.periodic ? 0 : i, between = 2 * i + 1;
    if (m.x.size() > 0) {
      fine.x[2 * i] = m.x[i];
      fine.x[between] = 0.5 * (m.x[i] + m.x[next]);
    }
    if (next == i) {
      fine.u[between] = m.u[i] + 0.5 * h * (m.v[i] + 0.25 * h * m.a[i]);
      fine.v[between] = m.v[i] + 0.5 * h * m.a[i];
      fine.a[between] = m.a[i];
      continue;
    }
    const double us = m.u[i] + m.u[next], vs = m.v[i] + m.v[next], as = m.a[i] + m.a[next];
    const double ud = m.u[next] - m.u[i], vd = m.v[next] - m.v[i], ad = m.a[next] - m.a[i];
    fine.u[between] = 0.5 * us - h * (5.0 / 32.0 * vd - h / 64.0 * as);
    fine.v[between] = 15.0 / 8.0 * ud / h - 7.0 / 16.0 * vs + h / 32.0 * ad;
    fine.a[between] = 1.5 * vd / h - 0.25 * as;
  }
  return fine;
}

}  // namespace shaker::estimator::diagnosis
