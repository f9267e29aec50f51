// sender/constraint_search.cpp
#include "sender/constraint_search.hpp"

#include <algorithm>

namespace ellicast::sender {

QuadraticForm::QuadraticForm(const Eigen::Matrix4d& Q)
    : xx(Q(0, 0)),
      yy(Q(1, 1)),
      zz(Q(2, 2)),
      xy(Q(0, 1) + Q(1, 0)),
      xz(Q(0, 2) + Q(2, 0)),
      yz(Q(1, 2) + Q(2, 1)),
      x(Q(0, 3) + Q(3, 0)),
      y(Q(1, 3) + Q(3, 1)),
      z(Q(2, 3) + Q(3, 2)),
      c(Q(3, 3)) {}

std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Eigen::Vector3d& x) {
    const double f1 = F1(x);
    if (!(f1 < 0.0)) return std::nullopt;
    return std::max(0.0, -F0(x) / f1);  // [BK02] eq. (2)
}

}  // namespace ellicast::sender
