// The obstacles along a path: one scene, or several, each for an equal part of it.
//
//     |--- scene 0 ---|--- scene 1 ---|--- scene 2 ---| s
//     0              1/3             2/3              1
//
// An obstacle that moves by at most v over the path is within v / (2 n) of its place in the middle of the
// n-th part. With so much additional clearance, the middle's scene covers the whole part.
#pragma once

#include "../scene/scene.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The scenes of a path: none, one, or `count` scenes, each for an equal part of [0, 1].
struct ScenesAlong {
    const Scene* const* scene = nullptr;
    int count = 0;

    explicit operator bool() const noexcept { return count > 0; }
    const Scene& operator[](int k) const noexcept { return *scene[k]; }
    /// Where part k begins.
    double begin(int k) const noexcept { return static_cast<double>(k) / count; }
    /// The index of the first scene that holds at s; at a boundary between two parts it differs from last().
    int first(double s) const noexcept { return part(s - edge); }
    /// The index of the last scene that holds at s.
    int last(double s) const noexcept { return part(s + edge); }
    /// The scene at s, which needs at least one; at a boundary the later one.
    const Scene& at(double s) const noexcept { return (*this)[last(s)]; }

private:
    static constexpr double edge = 1e-9;  // of s

    /// The index (0 to count - 1) of the part of the path whose range of s contains s; the last part beyond
    /// 1.
    int part(double s) const noexcept {
        const int k = static_cast<int>(max(s, 0.0) * count);
        return k < count ? k : count - 1;
    }
};

}  // namespace armangle

#include "../names/end.hpp"
