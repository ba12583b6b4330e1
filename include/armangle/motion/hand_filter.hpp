// Filters the samples of a person's hand, a camera or a network into a target pose and its velocity for every
// control cycle.
//
// A critically damped g-h filter on position and rotation follows a constant velocity without lag:
//
//     predicted = pose + velocity T,  r = measured - predicted,  pose = predicted + (1 - a^2) r,
//     velocity += (1 - a)^2 / T r,    a = exp(-omega T).
//
// If samples are rarer than cycles, each of them makes this estimate jump. The target then converges to the
// estimate, also critically damped: neither pose nor velocity jumps. That time is subtracted from 1 / omega.
// The acceleration is the change of velocity, smoothed once more. Without a filter the velocity is the
// difference of two samples, reduced if it oscillates.
// A sample far from its prediction is an outlier at first: the pose continues as predicted and slows down. A
// jump is accepted after it has lasted for `patience`.
// Source: E. Brookner, Tracking and Kalman Filtering Made Easy (1998), section 1.2.
#pragma once

#include "../numbers/twist.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Settings for smoothing target samples and rejecting outliers.
struct HandFilter {
    double omega = 40.0;     // 1/s; infinite: samples are used as they come
    double patience = 0.12;  // s that a jump must last to be accepted; 0: every sample is accepted
    double jump = 0.04;      // m: a sample further from its prediction is a jump
    double turn = 0.35;      // rad: the same for rotations
};

/// Parameters of the filter of a hand's samples.
struct HandFilterTuning {
    static constexpr double stale = 0.06;    // s: a sample repeated for longer is a target at rest ...
    static constexpr double periods = 1.25;  // ... unless so many of the device's periods last longer
    static constexpr double seldom = 0.5;    // s: longer than the period of any device
    static constexpr double slowing = 0.15;  // s in which a prediction without samples slows down
    static constexpr double fastest = 20.0;  // m/s and rad/s: a faster difference of samples is a jump
    static constexpr double smooth = 0.03;   // s over which the acceleration is averaged
    static constexpr double rare = 1.5;      // cycles between samples beyond which corrections are spread ...
    static constexpr double convergence_periods = 1.0;  // ... over so many of their periods, ...
    static constexpr double longest = 0.025;            // ... each of which counts as at most this, s
    static constexpr double shared = 0.4;    // of that time, taken from 1 / omega of the estimate, ...
    static constexpr double least = 0.5;     // ... of which at least this share remains
    static constexpr double newest = 0.125;  // weight of the newest sample in the changes of velocity
    static constexpr double calm = 0.1;  // m/s and rad/s of oscillation up to which a velocity is accepted
};

/// A target whose samples may be late, jump or fail: its pose and velocity.
class Hand {
public:
    /// A filter without a target yet.
    explicit Hand(const HandFilter& options) noexcept : options_(options) {}

    /// Starts with a target at rest at `pose`; required before the first tick().
    void start(const Pose<double>& pose) noexcept {
        pose_ = shown_ = last_sample_ = sample_ = suspect_ = pose;
        velocity_ = shown_velocity_ = acceleration_ = measured_ = drift_ = Twist{};
        age_ = suspected_ = changed_ = changes_ = convergence_time_ = 0;
        held_ = false;
    }

    /// Advances one cycle of dt s; `sample` is null if no sample arrived, or no valid pose.
    void tick(const Pose<double>* sample, double dt) noexcept {
        const Twist before = shown_velocity_;
        const bool goes_on = estimate(sample, dt);
        show(dt);
        if (goes_on) accelerate(before, dt);
    }

    /// The filtered target pose.
    const Pose<double>& pose() const noexcept { return shown_; }
    /// The velocity of the target (m/s, rad/s).
    const Twist& velocity() const noexcept { return shown_velocity_; }
    /// m/s^2 and rad/s^2, some hundredths of a second late; 0 while no sample is accepted.
    const Twist& acceleration() const noexcept { return acceleration_; }
    /// Whether the last cycle had no accepted sample, so that the pose continues at a decaying velocity.
    bool held() const noexcept { return held_; }
    /// The target pose predicted `ahead` s from now, at constant velocity.
    Pose<double> predicted(double ahead) const noexcept { return moved_by(shown_, shown_velocity_ * ahead); }

    /// Calls `visit` for the state that one cycle passes to the next, to save or restore it (saved.hpp).
    template <class Visit>
    void each_number(Visit& visit) {
        visit.all(pose_, sample_, suspect_, last_sample_, shown_, velocity_, shown_velocity_, acceleration_,
                  measured_, drift_, changes_, convergence_time_, age_, since_, period_, changed_, between_,
                  suspected_, held_);
    }

private:
    /// Whether samples are used as they come, without a filter.
    bool is_plain() const noexcept { return !(options_.omega < infinity); }

    /// Advances the estimate by dt (s). True if the acceleration may be updated; false if the sample is
    /// missing or a jump, if the estimate restarts, or if an unfiltered sample repeats.
    bool estimate(const Pose<double>* sample, double dt) noexcept {
        age_ += dt;
        changed_ += dt;
        held_ = false;
        const bool other = sample && !same(*sample, sample_);
        const bool fresh = other || (sample && age_ > stale());
        if (other) {
            between_[0] = between_[1];
            between_[1] = changed_;
            changed_ = 0;
        }
        if (!sample || (!fresh && suspected_ > 0)) return wait(dt);
        if (!fresh && is_plain()) return rest_plain();
        if (!fresh) {
            pose_ = moved_by(pose_, velocity_ * dt);
            since_ += dt;
            return true;
        }
        if (is_jump(*sample, dt)) return suspect(*sample, dt);
        suspected_ = 0;
        is_plain() ? take(*sample) : blend(*sample, dt, !other);
        remember(*sample);
        return true;
    }

    /// Updates the shown pose: the estimate, or the value that converges to it.
    void show(double dt) noexcept {
        if (!(convergence_time_ > 0)) {
            shown_ = pose_;
            shown_velocity_ = velocity_;
            return;
        }
        const double w = 1.0 / convergence_time_, left = std::exp(-w * dt);
        const Twist off = difference(moved_by(pose_, velocity_ * -dt), shown_),
                    faster = shown_velocity_ - velocity_, pull = faster + off * w;
        shown_ = moved_by(pose_, (off + pull * dt) * left);
        shown_velocity_ = velocity_ + (faster - pull * (w * dt)) * left;
    }

    /// Whether two poses are equal to the bit.
    static bool same(const Pose<double>& a, const Pose<double>& b) noexcept {
        const auto equal = [](const Vec3<double>& u, const Vec3<double>& v) {
            return u.x == v.x && u.y == v.y && u.z == v.z;
        };
        return equal(a.position, b.position) && equal(a.rotation.x, b.rotation.x) &&
               equal(a.rotation.y, b.rotation.y) && equal(a.rotation.z, b.rotation.z);
    }

    /// The time (s) after which a repeated sample counts as new. The shorter of the last two periods is used,
    /// because a target that rested has a long one.
    double stale() const noexcept {
        const double period = min(between_[0], between_[1]);
        return period < HandFilterTuning::seldom
                   ? max(HandFilterTuning::stale, HandFilterTuning::periods * period)
                   : HandFilterTuning::stale;
    }

    /// Whether a motion (m, rad) is larger than a jump.
    bool far(const Twist& t) const noexcept {
        return norm(t.linear) > options_.jump || norm(t.angular) > options_.turn;
    }

    /// Whether a sample is a jump: too far from the pose predicted over dt s.
    bool is_jump(const Pose<double>& sample, double dt) const noexcept {
        return options_.patience > 0 && far(difference(moved_by(pose_, velocity_ * dt), sample));
    }

    /// Treats a sample as a possible jump: continues as without a sample, or restarts at it after samples
    /// have stayed near it for `patience`. Returns false, as estimate() then does.
    bool suspect(const Pose<double>& sample, double dt) noexcept {
        const bool stays = suspected_ > 0 && !far(difference(suspect_, sample));
        suspected_ = stays ? suspected_ + age_ : dt;
        suspect_ = sample;
        remember(sample);
        if (suspected_ < options_.patience) {
            wait(dt);
            last_sample_ = pose_;
        } else {
            start(sample);
        }
        return false;
    }

    /// A cycle without an accepted sample: the pose continues at the predicted velocity, which decays.
    /// Returns false, as estimate() then does.
    bool wait(double dt) noexcept {
        held_ = true;
        since_ += dt;
        pose_ = moved_by(pose_, velocity_ * dt);
        velocity_ = velocity_ * std::exp(-dt / HandFilterTuning::slowing);
        acceleration_ = Twist{};
        return false;
    }

    /// Takes the pose of an unfiltered sample that repeats, regardless of predictions made without samples.
    /// Returns false, as estimate() then does.
    bool rest_plain() noexcept {
        pose_ = last_sample_;
        if (age_ > 2.0 * period_) velocity_ = acceleration_ = Twist{};
        return false;
    }

    /// Sets the estimate to the sample, unfiltered. The velocity is that between the last two samples, less
    /// if it oscillates.
    void take(const Pose<double>& sample) noexcept {
        const Twist speed = difference(last_sample_, sample) * (1.0 / age_);
        const bool possible =
            norm(speed.linear) < HandFilterTuning::fastest && norm(speed.angular) < HandFilterTuning::fastest;
        velocity_ = possible ? speed * believed(speed) : Twist{};
        period_ = age_;
        pose_ = sample;
    }

    /// The share of the difference velocity that is used. A target's velocity changes in one direction for
    /// many samples; an alternating change is noise.
    double believed(const Twist& speed) noexcept {
        const auto size = [](const Twist& t) { return std::hypot(norm(t.linear), norm(t.angular)); };
        const Twist change = speed - measured_;
        measured_ = speed;
        drift_ = drift_ + (change - drift_) * HandFilterTuning::newest;
        changes_ += (size(change) - changes_) * HandFilterTuning::newest;
        const double tremble = max(changes_ - size(drift_), 0.0);
        const double share = HandFilterTuning::calm / max(tremble, HandFilterTuning::calm);
        return share * share;
    }

    /// Moves the estimate towards a sample. If the sample is `repeated`, the target rests and its velocity
    /// decays; otherwise a target that turned once between two samples would seem to turn indefinitely.
    void blend(const Pose<double>& sample, double dt, bool repeated) noexcept {
        const Pose<double> predicted = moved_by(pose_, velocity_ * dt);
        const Twist rest = difference(predicted, sample);
        const double T = since_ + dt;
        convergence_time_ = T > HandFilterTuning::rare * dt
                                ? HandFilterTuning::convergence_periods * min(T, HandFilterTuning::longest)
                                : 0.0;
        const double a = std::exp(-estimating() * T);
        pose_ = moved_by(predicted, rest * (1.0 - a * a));
        const Twist now = (velocity_ + rest * ((1.0 - a) * (1.0 - a) / T)) * (repeated ? a : 1.0);
        velocity_ = {now.linear * possible(now.linear), now.angular * possible(now.angular)};
    }

    /// The factor that reduces a velocity to the greatest possible one.
    static double possible(const Vec3<double>& velocity) noexcept {
        return HandFilterTuning::fastest / max(norm(velocity), HandFilterTuning::fastest);
    }

    /// The filter frequency (1/s) of the estimate. It is raised because the shown pose, which converges to
    /// the estimate, also smooths and lags.
    double estimating() const noexcept {
        return options_.omega / max(HandFilterTuning::least,
                                    1.0 - HandFilterTuning::shared * options_.omega * convergence_time_);
    }

    /// Averages the acceleration from the last change of the shown velocity.
    void accelerate(const Twist& before, double dt) noexcept {
        const Twist change = (shown_velocity_ - before) * (1.0 / dt);
        acceleration_ =
            acceleration_ + (change - acceleration_) * -std::expm1(-dt / HandFilterTuning::smooth);
    }

    /// Stores a sample received now, and the present estimate as the pose of that time.
    void remember(const Pose<double>& sample) noexcept {
        sample_ = sample;
        last_sample_ = pose_;
        age_ = 0;
        since_ = 0;
    }

    HandFilter options_;
    Pose<double> pose_ = identity_pose(), sample_ = identity_pose(), suspect_ = identity_pose();
    Pose<double> last_sample_ = identity_pose();  // the sample when it last changed
    Pose<double> shown_ = identity_pose();        // the part of the estimate that is followed
    Twist velocity_, shown_velocity_, acceleration_;
    Twist measured_, drift_;       // last difference velocity, and the mean of its changes ...
    double changes_ = 0;           // ... and of their sizes, m/s and rad/s
    double convergence_time_ = 0;  // s in which the shown pose converges to the estimate; 0: they are equal
    double age_ = 0;               // s since the sample changed
    double since_ = 0;             // s since a sample was accepted
    double period_ = 0;            // s between samples
    double changed_ = 0;           // s since the sample differed ...
    double between_[2]{};          // ... and between such changes, the last two
    double suspected_ = 0;         // s that a jump has lasted
    bool held_ = false;
};

}  // namespace armangle

#include "../names/end.hpp"
