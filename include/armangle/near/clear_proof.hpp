// The arm angles at which a nearly S-R-S arm touches nothing: stretches that are proven, on the true chain.
//
//     |---free---|-free-|-|x|--- touching ---|x|-|-free-|      x: shorter than the least, left out
//
// About the posture at the middle of a stretch a hull says theta = theta_c + u t + rho, |rho_i| <= r_i. That
// is a straight move of the joints, both ways, and a box about it: straight_move.hpp proves that nothing
// touches on all of it, or that something does, and what it leaves open is halved. The tool does not move.
#pragma once

#include "../scene/clear.hpp"
#include "../scene/straight_move.hpp"
#include "feasible.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace near_rule {
inline constexpr double least_clear = 1e-7;   // rad: half width of a stretch that is not halved any more
inline constexpr int clear_looks = 3000;      // of one pose and branch
inline constexpr int widest_halvings = 26;    // of the clearance
inline constexpr double wide_clear = 0.0123;  // rad: half width of what is looked at first
}  // namespace near_rule

/// The true frames, as scenes see them: a link's shapes are fixed to the frame of that number.
inline void place_arm(const NearArm& arm, const Scene&, const double* q, Placement& out) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    for (int k = 0; k <= joints; ++k) {
        if (arm.nominal.has_base) frame[k] = arm.nominal.base_inverse * frame[k];
        out.origin[k] = frame[k].position;
        if (k < joints) out.axis[k] = frame[k].rotation.z * arm.nominal.sign[k];
    }
    out.frames.plane = {frame[3], frame[4]};
    out.frames.flange = frame[joints];
    for (const int link : {1, 2, 5, 6}) out.frames.swinging[detail::swinging_place(link)] = frame[link];
}

/// As of an exact arm. From frame to frame: what lies along a joint's axis does not turn with it.
template <class Weight>
double levers(const NearArm&, const Placement& at, int link, const Vec3<double>& p,
              const Weight& weight) noexcept {
    double sum = weight(link) * norm(p - at.origin[link]);
    for (int k = 1; k <= link; ++k) {
        const Vec3<double> along = at.origin[k] - at.origin[k - 1];
        const double axial = abs(dot(along, at.axis[k - 1]));
        sum += weight(k - 1) * axial + weight(k) * norm(cross(along, at.axis[k - 1]));
    }
    return sum;
}

/// How near a posture of the true chain is to what stands about; along d (rad) its rate.
inline Proximity proximity(const NearArm& arm, const Scene& scene, const double* q, const double (&d)[joints],
                           bool turning_alone = false) noexcept {
    return StraightMove<NearArm>(arm, scene).proximity(q, d, turning_alone);
}

namespace detail {

/// The work on one pose and branch.
class ClearProof {
public:
    ClearProof(const NearArm& arm, const Scene& scene, const Pose<double>& pose, const Triad<double>& on,
               const Configuration<double>& gc) noexcept
        : arm_(arm),
          pose_(pose),
          on_(on),
          gc_(gc),
          flange_(flange_pose(arm.nominal, pose)),
          move_(arm, scene) {}

    /// What is clear of these arcs; `unproven` grows by what is left out and not known.
    void run(const ArcSet& own, ArcSet& out, double& unproven) noexcept {
        make_empty(out);
        for (int i = 0; i < own.count; ++i) {
            const Arc& arc = own.arc[i];
            const double width = arc.upper - arc.lower;
            const int n = 1 + static_cast<int>(width / (2.0 * near_rule::wide_clear));
            tag_ = own.full ? 0 : arc.lower_tag;
            open_ = false;
            for (int k = 0; k < n; ++k)
                settle(arc.lower + width * k / n, arc.lower + width * (k + 1) / n, out);
            if (open_) close(own.full ? 0 : arc.upper_tag, out);
        }
        merge(out);
        unproven += unproven_;
    }

    /// The pair that touched somewhere; 0: none did.
    Tag touching() const noexcept { return touching_; }

private:
    /// Stretches in rising order: free ones are joined, what is between them ends them.
    void settle(double lower, double upper, ArcSet& out) noexcept {
        const double middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
        Tag pair = 0;
        const Nearness found = --looks_ < 0 ? Nearness::open : look(middle, half, pair);
        if (found == Nearness::clear) {
            if (!open_) start_ = lower;
            open_ = true;
            end_ = upper;
            return;
        }
        if (found == Nearness::open && half > near_rule::least_clear && looks_ >= 0) {
            settle(lower, middle, out);
            return settle(middle, upper, out);
        }
        const Tag by = pair ? pair : make_tag(0, Side::unproven);
        if (found == Nearness::touching) touching_ = pair;
        if (found == Nearness::open && half > near_rule::least_clear) unproven_ += upper - lower;
        if (found == Nearness::open && pair == 0 && half > 0) unproven_ += upper - lower;
        if (open_) close(by, out);
        tag_ = by;
    }

    void close(Tag by, ArcSet& out) noexcept {
        if (out.count == ArcSet::capacity) unproven_ += end_ - start_;
        put(out, {start_, end_, tag_, by});
        open_ = false;
    }

    /// What is known of the stretch of this half width about psi.
    Nearness look(double psi, double half, Tag& pair) noexcept {
        const PsiPlane<double> plane(on_, sin_cos(psi));
        SinCos<double> angle[joints];
        if (!posture(plane, angle)) return Nearness::open;
        const JointLanes theta = theta_of(angle);
        Hull<double> hull{};
        if (half > 0 && !(prove_hull(arm_, pose_, plane, angle, psi, half, hull) &&
                          keeps_branch(arm_.nominal, gc_, hull)))
            return Nearness::open;
        double q[joints], d[joints], off[joints];
        for (int j = 0; j < joints; ++j) {
            const double sign = arm_.nominal.sign[j];
            q[j] = sign * (theta[j] - arm_.nominal.offset[j]);
            d[j] = sign * half * hull.slope[j];
            off[j] = half > 0 ? hull.radius[j] : near_rule::rounding;
        }
        return move_.about(q, d, off, &flange_, pair);
    }

    /// The posture at a plane: the quick way, or from that found last, which is near.
    bool posture(const PsiPlane<double>& plane, SinCos<double> (&angle)[joints]) noexcept {
        bool found = solve_quickly(arm_, pose_, plane, gc_, angle);
        if (!found && known_) {
            for (int j = 0; j < joints; ++j) angle[j] = last_[j];
            found = newton(arm_, pose_, plane, gc_, angle) == Status::OK;
        }
        found = found ||
                (hard_++ < near_rule::hard && solve_angles(arm_, pose_, plane, gc_, angle) == Status::OK);
        if (!found) return false;
        for (int j = 0; j < joints; ++j) last_[j] = angle[j];
        return known_ = true;
    }

    const NearArm& arm_;
    const Pose<double>& pose_;
    const Triad<double>& on_;
    const Configuration<double>& gc_;
    Pose<double> flange_;
    StraightMove<NearArm> move_;
    bool known_ = false, open_ = false;
    SinCos<double> last_[joints];
    double start_ = 0, end_ = 0, unproven_ = 0;
    Tag tag_ = 0, touching_ = 0;
    int looks_ = near_rule::clear_looks, hard_ = 0;
};

}  // namespace detail

/// The pair of hand, or link 0, and what stands about that touch at a pose, whatever the joints; 0: none.
inline Tag rest_contact(const NearArm& arm, const Scene& scene, const Pose<double>& pose) noexcept {
    return scene.base_tag ? scene.base_tag : held_contact(scene, flange_pose(arm.nominal, pose));
}

/// Leaves of proven arcs of a pose and branch what is clear of a scene. `blocking`: the pair that touches
/// where nothing is left; 0: none is known. `turning_alone`: hand and link 0 may touch.
inline void keep_clear(const NearArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
                       ProvenArcs& arcs, Tag& blocking, bool turning_alone = false) noexcept {
    blocking = 0;
    make_empty(arcs.open);
    if (arcs.arcs.empty()) return;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    if (!turning_alone) blocking = rest_contact(arm, scene, exact);
    if (blocking) {
        make_empty(arcs.arcs);
        arcs.status = Status::POSE_BLOCKED;
        return;
    }
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, exact));
    const Configuration<double> sign = configuration(gc);
    const ArcSet own = arcs.arcs;
    detail::ClearProof proof(arm, scene, exact, on, sign);
    proof.run(own, arcs.arcs, arcs.unproven);
    if (!arcs.arcs.empty()) return;
    blocking = proof.touching();
    arcs.status = blocking ? Status::CLEARANCE : Status::NEAR_SINGULAR;
}

/// Of the arc of `open`, proven and clear, that holds psi, what keeps the soft clearance too; false where
/// nothing of it does, or no arc holds psi.
inline bool keep_soft(const NearArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
                      const ArcSet& open, double psi, ArcSet& out) noexcept {
    const Place at = find(open, psi);
    if (at.index < 0) return false;
    Scene asked = scene;
    asked.clearance += scene.soft;
    ArcSet here;
    make_empty(here);
    here.arc[here.count++] = open.arc[at.index];
    here.full = open.full;
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, pose));
    const Configuration<double> sign = configuration(gc);
    double unproven = 0;
    detail::ClearProof(arm, asked, pose, on, sign).run(here, out, unproven);
    return !out.empty();
}

/// The psi of proven arcs `own` that keeps farthest away, and the nearest pair there; of exact pose and turn.
inline Widest widest(const NearArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
                     const ArcSet& own) noexcept {
    if (own.empty()) return no_widest;
    const Triad<double> on = triad(arm.nominal, flange_pose(arm.nominal, pose));
    const Configuration<double> sign = configuration(gc);
    const double psi =
        widest_psi(scene, arm.nominal.size, near_rule::widest_halvings, [&](double clearance, ArcSet& left) {
            Scene asked = scene;
            asked.clearance = clearance;
            double unproven = 0;
            detail::ClearProof(arm, asked, pose, on, sign).run(own, left, unproven);
        });
    if (is_nan(psi)) return no_widest;
    const Inverse at = inverse(arm, pose, psi, gc), rate = self_motion_rate(arm, pose, psi, gc);
    if (at.status != Status::OK || rate.status != Status::OK) return no_widest;
    double d[joints];
    for (int j = 0; j < joints; ++j) d[j] = rate.q[j];
    return {psi, proximity(arm, scene, at.q, d, true)};
}

/// Psi_all of a pose in branch gc of the true chain that keeps clear of a scene.
inline void feasible(const NearArm& arm, const Scene& scene, const Pose<double>& pose, int gc,
                     const Limits& limits, double margin, ProvenArcs& out, Tag& blocking) noexcept {
    feasible(arm, pose, gc, limits, margin, out);
    keep_clear(arm, scene, pose, gc, out, blocking);
}

}  // namespace armangle

#include "../names/end.hpp"
