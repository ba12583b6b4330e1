// Convex hulls of points, and what is nearest between two of them.
//
// The differences of the points of two hulls are a hull too, and its least point v is the way from one to the
// other. Any three or four of its corners hold a least point that lies no nearer to the origin than v does:
//
//     .-----w        w is the corner farthest towards the origin. All corners lie beyond the plane through it
//     |      \       across v, so that  v . w / |v| <= distance <= |v| : a lower bound from the corner, an
//     |   v---+      upper bound from a pair of points. The least point of the simplex and w is nearer than
//     v,
//     `------'       or v was the nearest.
//           o        Source: Gilbert, Johnson, Keerthi (1988), IEEE J. Robotics and Automation 4(2).
#pragma once

#include "approach.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Points in a frame, of which the convex hull is meant; points inside the hull have no effect.
struct ConvexHull {
    const Vec3<double>* corners;
    int count;
    Pose<double> frame;

    /// The point of the hull that lies farthest along a direction, in the outer frame.
    Vec3<double> farthest(const Vec3<double>& direction) const noexcept {
        const Vec3<double> own = transposed_times(frame.rotation, direction);
        int at = 0;
        double most = dot(own, corners[0]);
        for (int k = 1; k < count; ++k) {
            const double along = dot(own, corners[k]);
            if (along > most) {
                most = along;
                at = k;
            }
        }
        return frame.rotation * corners[at] + frame.position;
    }
};

/// Parameters of convex hulls.
struct ConvexHullTuning {
    /// The largest number of steps; about as many as a hull has corners near the nearest point are needed.
    static constexpr int most_steps = 64;
    /// The search ends when both bounds of the distance differ by less than this share of the coordinates.
    static constexpr double rounding = 4e-16;
};

namespace detail {

/// At most four differences of a corner of one hull and a corner of the other, and the point of their simplex
/// that is nearest to the origin (GJK algorithm).
class Simplex {
public:
    struct Corner {
        Vec3<double> p, q, w;  // of one hull, of the other, p - q
    };

    /// Begins with one corner.
    explicit Simplex(const Corner& first) noexcept : corner_{first}, v_(first.w) {}

    /// The point of the simplex that is nearest to the origin.
    const Vec3<double>& nearest() const noexcept { return v_; }
    /// Whether the simplex contains the origin.
    bool holds_origin() const noexcept { return inside_; }

    /// The nearest point of the simplex as a pair of points, one of each hull.
    Approach pair() const noexcept {
        Vec3<double> p{0, 0, 0}, q{0, 0, 0};
        for (int k = 0; k < count_; ++k) {
            p = mul_add(corner_[k].p, share_[k], p);
            q = mul_add(corner_[k].q, share_[k], q);
        }
        return {p, inside_ ? p : q, inside_ ? 0.0 : norm(p - q)};
    }

    /// Adds a corner and finds the nearest point of the new simplex. False if it is not nearer to the origin.
    bool add(const Corner& more) noexcept {
        corner_[count_] = more;
        const int all = count_ + 1;
        Face best{{0, 0, 0}, {1, 0, 0}, 0, dot(v_, v_), v_};
        for (int i = 0; i < all; ++i) {
            keep_point(i, best);
            for (int j = 0; j < i; ++j) {
                keep_edge(j, i, best);
                for (int k = 0; k < j; ++k) keep_triangle(k, j, i, best);
            }
        }
        if (all == 4 && within()) return true;
        if (best.size == 0) return false;
        Corner kept[3];
        for (int k = 0; k < best.size; ++k) kept[k] = corner_[best.at[k]];
        for (int k = 0; k < best.size; ++k) {
            corner_[k] = kept[k];
            share_[k] = best.share[k];
        }
        count_ = best.size;
        v_ = best.v;
        return true;
    }

private:
    /// A face of the simplex with the weights of its corners and its point nearest to the origin.
    struct Face {
        int at[3];
        double share[3];
        int size;
        double square;
        Vec3<double> v;
    };

    /// Replaces `best` by the found face if its point is nearer to the origin.
    static void keep(const Face& found, Face& best) noexcept {
        if (found.square < best.square) best = found;
    }

    /// Keeps corner i in `best` if it is nearer to the origin.
    void keep_point(int i, Face& best) const noexcept {
        const Vec3<double>& v = corner_[i].w;
        keep({{i, 0, 0}, {1, 0, 0}, 1, dot(v, v), v}, best);
    }

    /// Keeps the edge of corners i and j in `best` if its nearest point lies between both and is nearer to
    /// the origin.
    void keep_edge(int i, int j, Face& best) const noexcept {
        const Vec3<double>&a = corner_[i].w, d = corner_[j].w - a;
        const double along = -dot(a, d), square = dot(d, d);
        if (!(along > 0 && along < square)) return;
        const double t = along / square;
        const Vec3<double> v = mul_add(d, t, a);
        keep({{i, j, 0}, {1.0 - t, t, 0}, 2, dot(v, v), v}, best);
    }

    /// Keeps the triangle of corners i, j and k in `best` if its nearest point lies within and is nearer to
    /// the origin.
    void keep_triangle(int i, int j, int k, Face& best) const noexcept {
        const Vec3<double>&a = corner_[i].w, &b = corner_[j].w, &c = corner_[k].w;
        const Vec3<double> n = cross(b - a, c - a);
        const double x = dot(cross(b, c), n), y = dot(cross(c, a), n), z = dot(cross(a, b), n);
        if (!(x > 0 && y > 0 && z > 0)) return;
        const double per = 1.0 / (x + y + z);
        const Vec3<double> v = mul_add(a, x * per, mul_add(b, y * per, c * (z * per)));
        keep({{i, j, k}, {x * per, y * per, z * per}, 3, dot(v, v), v}, best);
    }

    /// Whether the origin lies within the tetrahedron of the four corners; then the hulls overlap and the
    /// weights give a common point. Otherwise nothing changes.
    bool within() noexcept {
        const auto volume = [this](int i, int j, int k) {
            return dot(cross(corner_[i].w, corner_[j].w), corner_[k].w);
        };
        const double part[4] = {volume(1, 2, 3), -volume(0, 2, 3), volume(0, 1, 3), -volume(0, 1, 2)};
        const double sum = part[0] + part[1] + part[2] + part[3];
        for (const double one : part)
            if (!(one / sum > 0)) return false;
        for (int k = 0; k < 4; ++k) share_[k] = part[k] / sum;
        count_ = 4;
        return inside_ = true;
    }

    Corner corner_[4];
    double share_[4] = {1.0, 0.0, 0.0, 0.0};
    int count_ = 1;
    Vec3<double> v_;
    bool inside_ = false;
};

}  // namespace detail

/// The nearest points of two hulls, with a lower bound of their distance (m) that was within 1e-12 m of it in
/// all tests. If the hulls overlap, both points are one common point and the distance is 0.
inline Approach nearest(const ConvexHull& first, const ConvexHull& second) noexcept {
    const auto corner = [&](const Vec3<double>& v) {
        const Vec3<double> p = first.farthest(-v), q = second.farthest(v);
        return detail::Simplex::Corner{p, q, p - q};
    };
    detail::Simplex simplex(corner(first.frame.position - second.frame.position));
    double least = 0;
    for (int step = 0; step < ConvexHullTuning::most_steps; ++step) {
        const Vec3<double> v = simplex.nearest();
        const double length = norm(v);
        if (!(length > 0)) break;
        const detail::Simplex::Corner next = corner(v);
        least = max(least, dot(v, next.w) / length);
        if (length - least <= ConvexHullTuning::rounding * (norm(next.p) + norm(next.q))) break;
        if (!simplex.add(next) || simplex.holds_origin()) break;
    }
    Approach out = simplex.pair();
    out.distance = simplex.holds_origin() ? 0.0 : min(least, out.distance);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
