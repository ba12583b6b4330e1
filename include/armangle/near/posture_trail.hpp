// Postures of one branch at several psi at once, each from those found before where it is not found by
// itself.
#pragma once

#include "inverse.hpp"

namespace armangle {

namespace near_rule {
inline constexpr int hard = 2;  // long searches for a first posture
}  // namespace near_rule

namespace detail {

/// The postures of a pose in one branch that were found last. Beside singularities a posture leads to its
/// neighbours, where the pose alone does not.
template <int N>
class PostureTrail {
public:
    using Several = Lane<N>;

    PostureTrail(const NearArm& arm, const Pose<double>& pose, const Triad<double>& on,
                 const Configuration<double>& gc) noexcept
        : arm_(arm), pose_(pose), on_(on), gc_(gc) {}

    /// The postures at the first `count` of these psi, and which of them are found.
    Found<Several> find(const double (&psi)[N], int count, const PsiPlane<Several>& plane,
                        bool (&is_found)[N]) noexcept {
        Found<Several> out = find_posture(arm_, spread<Several>(pose_), plane, spread<Several>(gc_));
        bool some_missing = false;
        for (int k = 0; k < N; ++k) {
            is_found[k] = k < count && out.left[k] <= near_rule::settled;
            some_missing |= k < count && !is_found[k];
        }
        if (some_missing) follow(psi, count, plane, is_found, out);
        for (int k = 0; k < count; ++k)
            if (is_found[k]) remember(psi[k], k, out);
        return out;
    }

private:
    /// The postures that are missing, each from that of the nearest psi that has one.
    void follow(const double (&psi)[N], int count, const PsiPlane<Several>& plane, bool (&is_found)[N],
                Found<Several>& found) noexcept {
        bool none = !begun_;
        for (int k = 0; k < count; ++k) none = none && !is_found[k];
        for (int k = 0; k < count && none; ++k) none = !(is_found[k] = first(psi[k], k, found));
        if (none) return;
        SinCos<Several> angle[joints];
        for (int j = 0; j < joints; ++j) angle[j] = found.angle[j];
        double wanted[N] = {};
        for (int k = 0; k < count; ++k) {
            if (is_found[k]) continue;
            wanted[k] = 1.0;
            int from = -1;
            double way = begun_ ? abs(psi[k] - last_psi_) : infinity;
            for (int i = 0; i < count; ++i) {
                if (!(is_found[i] && abs(psi[k] - psi[i]) < way)) continue;
                from = i;
                way = abs(psi[k] - psi[i]);
            }
            for (int j = 0; j < joints; ++j) {
                angle[j].sin.set(k, from < 0 ? last_[j].sin : found.angle[j].sin[from]);
                angle[j].cos.set(k, from < 0 ? last_[j].cos : found.angle[j].cos[from]);
            }
        }
        const auto asked = Several(0.0) < Several::load(wanted);
        const auto there = newton(arm_, spread<Several>(pose_), plane, spread<Several>(gc_), asked, angle);
        for (int k = 0; k < count; ++k) {
            if (!asked[k]) continue;
            is_found[k] = there[k];
            for (int j = 0; j < joints; ++j) {
                found.angle[j].sin.set(k, angle[j].sin[k]);
                found.angle[j].cos.set(k, angle[j].cos[k]);
            }
        }
    }

    /// A first posture, by a long search.
    bool first(double psi, int k, Found<Several>& found) noexcept {
        if (hard_++ >= near_rule::hard) return false;
        SinCos<double> angle[joints];
        if (solve_angles(arm_, pose_, {on_, sin_cos(psi)}, gc_, angle) != Status::OK) return false;
        for (int j = 0; j < joints; ++j) {
            found.angle[j].sin.set(k, angle[j].sin);
            found.angle[j].cos.set(k, angle[j].cos);
        }
        return true;
    }

    void remember(double psi, int k, const Found<Several>& found) noexcept {
        for (int j = 0; j < joints; ++j) last_[j] = {found.angle[j].sin[k], found.angle[j].cos[k]};
        last_psi_ = psi;
        begun_ = true;
    }

    const NearArm& arm_;
    const Pose<double>& pose_;
    const Triad<double>& on_;
    Configuration<double> gc_;
    bool begun_ = false;
    SinCos<double> last_[joints];
    double last_psi_ = 0;
    int hard_ = 0;
};

}  // namespace detail

}  // namespace armangle
