// Postures of one branch at several psi at once, each from those found before where it is not found by
// itself.
#pragma once

#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the postures of one branch at several psi.
struct PostureTrailTuning {
    static constexpr int hard = 2;     // long searches for a first posture
    static constexpr int places = 64;  // of the circle, each with the posture that was found there last
};

namespace detail {

/// Finds postures of a pose in one branch at many psi, and keeps those found last: near singularities a
/// posture leads to its neighbours where the pose alone does not.
template <int N>
class PostureTrail {
public:
    using Several = Lane<N>;

    /// Keeps references to an arm, a pose and its triad; no posture is known yet.
    PostureTrail(const ChainArm& arm, const Pose<double>& pose, const Triad<double>& on,
                 const Configuration<double>& gc) noexcept
        : arm_(arm), pose_(pose), on_(on), gc_(gc) {}

    /// Finds the postures at the first `count` (0..N) of these psi (rad), whose planes are in `plane`;
    /// is_found says which were found. Other lanes of the result mean nothing.
    Found<Several> find(const double (&psi)[N], int count, const PsiPlane<Several>& plane,
                        bool (&is_found)[N]) noexcept {
        Found<Several> out = find_posture(arm_, spread<Several>(pose_), plane, spread<Several>(gc_));
        bool some_missing = false;
        for (int k = 0; k < N; ++k) {
            is_found[k] = k < count && out.left[k] <= ChainInverseTuning::settled;
            some_missing |= k < count && !is_found[k];
        }
        if (some_missing) {
            follow(psi, count, plane, is_found, out);
            return out;
        }
        for (int k = 0; k < count; ++k) remember(psi[k], k, out);
        return out;
    }

private:
    /// Adds missing postures to `found` and marks them in `is_found`, by Newton's method, each from the known
    /// posture of the nearest psi.
    void follow(const double (&psi)[N], int count, const PsiPlane<Several>& plane, bool (&is_found)[N],
                Found<Several>& found) noexcept {
        for (int k = 0; k < N; ++k)
            if (is_found[k]) remember(psi[k], k, found);
        for (int k = 0; k < count && !begun_; ++k) {
            is_found[k] = first(psi[k], k, found);
            if (is_found[k]) remember(psi[k], k, found);
        }
        if (!begun_) return;
        bool some_more = true, some_missing = true;
        while (some_more && some_missing) {
            SinCos<Several> angle[joints];
            for (int j = 0; j < joints; ++j) angle[j] = found.angle[j];
            double wanted[N] = {};
            for (int k = 0; k < count; ++k) {
                if (is_found[k]) continue;
                wanted[k] = 1.0;
                const Known& from = known_[nearest(psi[k])];
                for (int j = 0; j < joints; ++j) {
                    angle[j].sin.set(k, from.angle[j].sin);
                    angle[j].cos.set(k, from.angle[j].cos);
                }
            }
            const auto asked = Several(0.0) < Several::load(wanted);
            const auto there =
                newton(arm_, spread<Several>(pose_), plane, spread<Several>(gc_), asked, angle);
            some_more = some_missing = false;
            for (int k = 0; k < count; ++k) {
                if (!asked[k]) continue;
                is_found[k] = there[k];
                some_more |= there[k];
                some_missing |= !there[k];
                for (int j = 0; j < joints; ++j) {
                    found.angle[j].sin.set(k, angle[j].sin[k]);
                    found.angle[j].cos.set(k, angle[j].cos[k]);
                }
                if (there[k]) remember(psi[k], k, found);
            }
        }
    }

    /// Writes a first posture, by the slower methods of solve_angles(), to lane k of `found`; false if none
    /// is found, or after `hard` attempts.
    bool first(double psi, int k, Found<Several>& found) noexcept {
        if (hard_++ >= PostureTrailTuning::hard) return false;
        SinCos<double> angle[joints];
        if (solve_angles(arm_, pose_, {on_, sin_cos(psi)}, gc_, angle) != Status::OK) return false;
        for (int j = 0; j < joints; ++j) {
            found.angle[j].sin.set(k, angle[j].sin);
            found.angle[j].cos.set(k, angle[j].cos);
        }
        return true;
    }

    /// The index of the memory for postures near this psi.
    static int place(double psi) noexcept {
        const int k = static_cast<int>((wrap(psi) + pi) * (PostureTrailTuning::places / two_pi));
        return k < PostureTrailTuning::places ? k : PostureTrailTuning::places - 1;
    }

    /// The index of the known posture whose psi is nearest; -1 if none is known.
    int nearest(double psi) const noexcept {
        int out = -1;
        double least = infinity;
        for (int k = 0; k < PostureTrailTuning::places; ++k) {
            if (!is_known_[k]) continue;
            const double way = abs(wrap(known_[k].psi - psi));
            if (!(way < least)) continue;
            least = way;
            out = k;
        }
        return out;
    }

    /// Keeps posture k as the known one near this psi.
    void remember(double psi, int k, const Found<Several>& found) noexcept {
        const int at = place(psi);
        for (int j = 0; j < joints; ++j) known_[at].angle[j] = {found.angle[j].sin[k], found.angle[j].cos[k]};
        known_[at].psi = psi;
        is_known_[at] = begun_ = true;
    }

    struct Known {
        double psi;
        SinCos<double> angle[joints];
    };
    const ChainArm& arm_;
    const Pose<double>& pose_;
    const Triad<double>& on_;
    Configuration<double> gc_;
    bool begun_ = false, is_known_[PostureTrailTuning::places] = {};
    Known known_[PostureTrailTuning::places];
    int hard_ = 0;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
