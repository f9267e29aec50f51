// receiver/float_lanes.hpp: private to receiver/flip_gains.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <numbers>

namespace ellicast::receiver {

/// Four floats in one register, each computed as it would be alone, to the same bits.
using Lanes = float __attribute__((vector_size(16)));

/// Four vectors.
struct Lanes3 {
    Lanes x, y, z;

    static Lanes3 of(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                     const Eigen::Vector3f& d) {
        return {Lanes{a[0], b[0], c[0], d[0]}, Lanes{a[1], b[1], c[1], d[1]},
                Lanes{a[2], b[2], c[2], d[2]}};
    }
};

// Sums in Eigen's order.
inline Lanes dot(const Lanes3& n, const Lanes3& m) {
    return n.x * m.x + (n.y * m.y + n.z * m.z);
}
inline Lanes3 cross(const Lanes3& n, const Lanes3& m) {
    return {n.y * m.z - n.z * m.y, n.z * m.x - n.x * m.z, n.x * m.y - n.y * m.x};
}
inline Lanes root(const Lanes& x) {
    Eigen::Array4f values;
    std::memcpy(values.data(), &x, sizeof(x));
    values = values.sqrt();
    Lanes result;
    std::memcpy(&result, values.data(), sizeof(result));
    return result;
}
inline Lanes norm(const Lanes3& n) {
    return root(dot(n, n));
}

/// common::angle_of, four at a time.
inline Lanes angle_of(const Lanes& x, const Lanes& y) {
    using Bits = std::int32_t __attribute__((vector_size(16)));
    constexpr float kPi = std::numbers::pi_v<float>;
    const auto magnitude = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(x) & 0x7fffffff);
    const Lanes larger = magnitude < y ? y : magnitude;
    const Lanes smaller = y < magnitude ? y : magnitude;
    const Lanes t = smaller / larger;
    const Lanes q = t * t;
    const Lanes low = t * (0.9999961116F + q * (-0.3331736806F + q * 0.1980781557F));
    const Lanes high =
        -0.1323334207F + q * (0.0796236715F + q * (-0.03360421956F + q * 0.006811792907F));
    const Lanes acute = low + t * q * q * q * high;
    const Lanes right = y > magnitude ? 0.5F * kPi - acute : acute;
    const Lanes angle = x < 0.0F ? kPi - right : right;
    return larger > 0.0F ? angle : Lanes{};
}
inline Lanes angle_between(const Lanes3& n, const Lanes3& m) {
    return angle_of(dot(n, m), norm(cross(n, m)));
}

}  // namespace ellicast::receiver
