// common/exact_orientation.cpp
#include "common/exact_orientation.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace ellicast::common {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon() / 2.0;  // [S97]: 2^-53

// An exact number as a sum of doubles whose bits do not overlap, smallest first; zeros are left
// out. Capacity N is the caller's proof that no operation makes it longer.
template <std::size_t N>
struct Expansion {
    std::array<double, N> terms{};
    std::size_t size = 0;

    void push(double term) {
        if (term != 0.0) terms[size++] = term;
    }

    // The largest term outweighs all others together.
    [[nodiscard]] int sign() const {
        if (size == 0) return 0;
        return terms[size - 1] > 0.0 ? 1 : -1;
    }
};

struct Pair {
    double high;
    double low;  // what rounding took from `high`
};

// [S97] figure 7, from Knuth. The compiler may not reassociate: see cmake/EllicastTargets.cmake.
Pair two_sum(double a, double b) {
    const double high = a + b;
    const double b_part = high - a;
    const double a_part = high - b_part;
    return {high, (a - a_part) + (b - b_part)};
}

// fma() rounds once, so it gives the rounding error itself.
Pair two_product(double a, double b) {
    const double high = a * b;
    return {high, std::fma(a, b, -high)};
}

Expansion<2> difference(double a, double b) {
    const Pair d = two_sum(a, -b);
    Expansion<2> result;
    result.push(d.low);
    result.push(d.high);
    return result;
}

// e + b, in place: [S97] figure 9, GROW-EXPANSION.
template <std::size_t N>
void grow(Expansion<N>& e, double b) {
    const std::size_t size = e.size;
    e.size = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const Pair s = two_sum(b, e.terms[i]);
        e.push(s.low);  // overwrites no term before its turn
        b = s.high;
    }
    e.push(b);
}

template <std::size_t N, std::size_t M>
Expansion<N + M> sum(const Expansion<N>& e, const Expansion<M>& f) {
    Expansion<N + M> result;
    for (std::size_t i = 0; i < e.size; ++i) result.push(e.terms[i]);
    for (std::size_t i = 0; i < f.size; ++i) grow(result, f.terms[i]);
    return result;
}

template <std::size_t N>
Expansion<N> negated(Expansion<N> e) {
    for (std::size_t i = 0; i < e.size; ++i) e.terms[i] = -e.terms[i];
    return e;
}

template <std::size_t N, std::size_t M>
Expansion<2 * N * M> product(const Expansion<N>& e, const Expansion<M>& f) {
    Expansion<2 * N * M> result;
    for (std::size_t i = 0; i < e.size; ++i) {
        for (std::size_t j = 0; j < f.size; ++j) {
            const Pair p = two_product(e.terms[i], f.terms[j]);
            grow(result, p.low);
            grow(result, p.high);
        }
    }
    return result;
}

using Differences = std::array<Expansion<2>, 3>;

Differences differences(const Vector3d& p, const Vector3d& q) {
    return {difference(p[0], q[0]), difference(p[1], q[1]), difference(p[2], q[2])};
}

// p_x q_y - p_y q_x
Expansion<16> minor(const Expansion<2>& px, const Expansion<2>& py, const Expansion<2>& qx,
                    const Expansion<2>& qy) {
    return sum(product(px, qy), negated(product(py, qx)));
}

int exact_sign(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    const Differences u = differences(a, d);
    const Differences v = differences(b, d);
    const Differences w = differences(c, d);
    // u . (v x w)
    const auto x = product(minor(v[1], v[2], w[1], w[2]), u[0]);
    const auto y = product(minor(v[2], v[0], w[2], w[0]), u[1]);
    const auto z = product(minor(v[0], v[1], w[0], w[1]), u[2]);
    return sum(sum(x, y), z).sign();
}

int exact_sign(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return minor(difference(a[0], c[0]), difference(a[1], c[1]), difference(b[0], c[0]),
                 difference(b[1], c[1]))
        .sign();
}

}  // namespace

int orientation(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    const Vector3d u = a - d;
    const Vector3d v = b - d;
    const Vector3d w = c - d;
    const double det = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                       u[2] * (v[0] * w[1] - v[1] * w[0]);
    // The sum of the magnitudes of the six products.
    const Vector3d ua = u.cwiseAbs();
    const Vector3d va = v.cwiseAbs();
    const Vector3d wa = w.cwiseAbs();
    const double permanent = ua[0] * (va[1] * wa[2] + va[2] * wa[1]) +
                             ua[1] * (va[2] * wa[0] + va[0] * wa[2]) +
                             ua[2] * (va[0] * wa[1] + va[1] * wa[0]);
    // [S97] section 4.3, stage A.
    const double bound = (7.0 + 56.0 * kEpsilon) * kEpsilon * permanent;
    if (det > bound) return 1;
    if (det < -bound) return -1;
    return exact_sign(a, b, c, d);
}

int orientation(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    const double left = (a[0] - c[0]) * (b[1] - c[1]);
    const double right = (a[1] - c[1]) * (b[0] - c[0]);
    const double det = left - right;
    const double bound = (3.0 + 16.0 * kEpsilon) * kEpsilon * (std::abs(left) + std::abs(right));
    if (det > bound) return 1;
    if (det < -bound) return -1;
    return exact_sign(a, b, c);
}

}  // namespace ellicast::common
