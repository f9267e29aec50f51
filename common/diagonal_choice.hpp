// common/diagonal_choice.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace ellicast::common {

/// Two triangles (a b c) and (b a d) with a common edge ab, which could be cd as well.
struct Quad {
    Eigen::Vector3d a, b, c, d;
    /// Of the faces beyond bc, ca, ad and db; any positive length.
    std::array<Eigen::Vector3d, 4> outer_normals;
    /// Unit, at a, b, c and d; what `rise` is about.
    std::array<Eigen::Vector3d, 4> vertex_normals;
};

/// Why cd might be the better diagonal. Each term is positive where it would be. Angles are those
/// of common/fast_angle.hpp.
struct DiagonalGain {
    /// Sum over the five edges of length x (dihedral angle), and 0.1 rad x the diagonal's own
    /// length: few and gentle creases, and the shorter diagonal where all is flat. A length.
    double crease = 0;
    /// Angles opposite ab less those opposite cd, radians: positive where ab is not Delaunay.
    double angle = 0;
    /// How much nearer cd comes to the surface that the vertex normals ask for (DESIGN section 7),
    /// as far as both diagonals' ends agree on it: at creases they don't, and normals say nothing.
    /// A length.
    double rise = 0;

    /// `unit`: the mean edge length of the mesh.
    [[nodiscard]] double weighed(double angle_weight, double rise_weight, double unit) const {
        return crease + angle_weight * unit * angle + rise_weight * rise;
    }
};
DiagonalGain diagonal_gain(const Quad& quad);

/// Weight of an edge's own length beside length x dihedral angle, in radians: where the surface is
/// flat within about this angle the shorter diagonal wins, as in most meshes that people make.
inline constexpr double kDiagonalLengthWeight = 0.1;

/// A flip must gain this many mean edge lengths, or ties would flip back and forth.
inline constexpr double kLeastDiagonalGain = 0.02;

/// What the sender found out about the way its mesh was triangulated, and tells the receiver: which
/// of a few weightings gets most of its diagonals right. 0 is also for whoever did not look.
inline constexpr std::uint8_t kDiagonalRules = 6;

struct DiagonalWeights {
    double angle = 0;
    double rise = 0;
    /// Mean edge lengths by which a diagonal between two vertices with marked tags is the better
    /// one: there the rule fails, as the sender found.
    double mark = 0;
};

/// Weights of a rule for a mesh that lacks a share `loss` of its vertices. What holds for the
/// original's edges says less and less of those between survivors: at 50 % loss all rules are
/// nearly one. `tagged`: the vertex normals are tags, not estimates. Requires rule <
/// kDiagonalRules.
DiagonalWeights diagonal_weights(std::uint8_t rule, bool tagged, double loss);

/// The same as diagonal_gain(quad).weighed(weights.angle, weights.rise, unit), without the terms
/// that weigh nothing.
double weighed_diagonal_gain(const Quad& quad, const DiagonalWeights& weights, double unit);

}  // namespace ellicast::common
