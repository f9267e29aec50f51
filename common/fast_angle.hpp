// common/fast_angle.hpp
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ellicast::common {

/// Angle between the positive x axis and (x, y), y >= 0: a minimax polynomial of the arc tangent
/// over [0, 1], off by at most 3e-7. A third of the time of std::atan2, and the same bits
/// everywhere; 0 at the origin.
template <class Real>
Real angle_of(Real x, Real y) {
    constexpr Real kPi = std::numbers::pi_v<Real>;
    const Real magnitude = std::abs(x);
    const Real larger = std::max(magnitude, y);
    if (!(larger > Real{0})) return Real{0};
    const Real t = std::min(magnitude, y) / larger;
    const Real q = t * t;
    const Real low =
        t * (Real(0.9999961116F) + q * (Real(-0.3331736806F) + q * Real(0.1980781557F)));
    const Real high =
        Real(-0.1323334207F) +
        q * (Real(0.0796236715F) + q * (Real(-0.03360421956F) + q * Real(0.006811792907F)));
    const Real acute = low + t * q * q * q * high;
    const Real right = y > magnitude ? Real(0.5) * kPi - acute : acute;
    return x < Real{0} ? kPi - right : right;
}

}  // namespace ellicast::common
