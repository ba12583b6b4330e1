// What a hand, a camera or a network sends, made into a pose and its velocity for every tick.
//
// A critically damped g-h filter on position and on rotation follows a constant velocity without lag:
//
//     predicted = pose + velocity T,  r = measured - predicted,  pose = predicted + (1 - a^2) r,
//     velocity += (1 - a)^2 / T r,    a = exp(-omega T).
//
// Where samples are rarer than ticks each of them makes this estimate jump. What is followed then settles on
// it, critically damped too, so that neither pose nor velocity jumps; the time that this takes is taken from
// 1 / omega.
// Its acceleration is what the velocity changed by, smoothed once more. Without a filter the velocity is that
// between two samples, or a share of it where it changes to and fro.
// A sample far from its prediction is an outlier until it has lasted: the pose goes on as predicted, slowing
// down, and only what stays where it jumped to for `patience` is believed.
// Source: E. Brookner, Tracking and Kalman Filtering Made Easy (1998), section 1.2.
#pragma once

#include "../numbers/twist.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// How samples of a hand are smoothed, and which of them are believed.
struct HandFilter {
    double omega = 40.0;     // 1/s; infinite: samples are taken as they come
    double patience = 0.12;  // s that a jump must last to be believed; 0: every sample is believed
    double jump = 0.04;      // m: further from its prediction a sample is a jump
    double turn = 0.35;      // rad: the same of rotations
};

namespace hand_rule {
inline constexpr double stale = 0.06;     // s: a sample repeated for longer is a hand at rest ...
inline constexpr double periods = 1.25;   // ... unless so many of the device's periods last longer
inline constexpr double seldom = 0.5;     // s: no device's period is as long
inline constexpr double slowing = 0.15;   // s in which a prediction without samples loses its speed
inline constexpr double fastest = 20.0;   // m/s and rad/s: a difference of samples beyond it is a jump
inline constexpr double smooth = 0.03;    // s over which the acceleration is averaged
inline constexpr double rare = 1.5;       // ticks between samples from which corrections are spread ...
inline constexpr double settles = 1.0;    // ... over so many of their periods, ...
inline constexpr double longest = 0.025;  // ... none of which counts as longer, s
inline constexpr double shared = 0.4;     // of that time, taken from 1 / omega of the estimate, ...
inline constexpr double least = 0.5;      // ... of which at least so much is left
inline constexpr double newest = 0.125;   // share of the newest sample in what velocities change by
inline constexpr double calm = 0.1;       // m/s and rad/s to and fro up to which a velocity is believed
}  // namespace hand_rule

/// A hand whose samples come late, jump or fail: where it is, and how fast.
class Hand {
public:
    explicit Hand(const HandFilter& options) noexcept : options_(options) {}

    void start(const Pose<double>& pose) noexcept {
        pose_ = shown_ = told_ = sample_ = suspect_ = pose;
        velocity_ = shown_velocity_ = acceleration_ = measured_ = drift_ = Twist{};
        age_ = suspected_ = changed_ = changes_ = settling_ = 0;
        held_ = false;
    }

    /// One tick of dt s; `sample` is null where none came, or none that is a pose.
    void tick(const Pose<double>* sample, double dt) noexcept {
        const Twist before = shown_velocity_;
        const bool goes_on = estimate(sample, dt);
        show(dt);
        if (goes_on) accelerate(before, dt);
    }

    const Pose<double>& pose() const noexcept { return shown_; }
    const Twist& velocity() const noexcept { return shown_velocity_; }
    /// m/s^2 and rad/s^2, some hundredths of a second late; none while no sample is believed.
    const Twist& acceleration() const noexcept { return acceleration_; }
    bool held() const noexcept { return held_; }
    Pose<double> predicted(double ahead) const noexcept { return moved_by(shown_, shown_velocity_ * ahead); }

    /// What a tick leaves to the next (saved.hpp).
    template <class Visit>
    void each_number(Visit& visit) {
        visit.all(pose_, sample_, suspect_, told_, shown_, velocity_, shown_velocity_, acceleration_,
                  measured_, drift_, changes_, settling_, age_, since_, period_, changed_, between_,
                  suspected_, held_);
    }

private:
    bool is_plain() const noexcept { return !(options_.omega < infinity); }

    /// Where the hand is, by its samples; false where none is believed, or it is taken as it comes.
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
        if (is_jump(*sample, dt)) return doubt(*sample, dt);
        suspected_ = 0;
        is_plain() ? take(*sample) : blend(*sample, dt, !other);
        remember(*sample);
        return true;
    }

    /// The estimate, or what settles on it.
    void show(double dt) noexcept {
        if (!(settling_ > 0)) {
            shown_ = pose_;
            shown_velocity_ = velocity_;
            return;
        }
        const double w = 1.0 / settling_, left = std::exp(-w * dt);
        const Twist off = difference(moved_by(pose_, velocity_ * -dt), shown_),
                    faster = shown_velocity_ - velocity_, pull = faster + off * w;
        shown_ = moved_by(pose_, (off + pull * dt) * left);
        shown_velocity_ = velocity_ + (faster - pull * (w * dt)) * left;
    }

    static bool same(const Pose<double>& a, const Pose<double>& b) noexcept {
        const auto equal = [](const Vec3<double>& u, const Vec3<double>& v) {
            return u.x == v.x && u.y == v.y && u.z == v.z;
        };
        return equal(a.position, b.position) && equal(a.rotation.x, b.rotation.x) &&
               equal(a.rotation.y, b.rotation.y) && equal(a.rotation.z, b.rotation.z);
    }

    /// s after which a sample that is repeated is believed again. Of the last two periods the shorter one
    /// counts: a hand that rested has a long one.
    double stale() const noexcept {
        const double period = min(between_[0], between_[1]);
        return period < hand_rule::seldom ? max(hand_rule::stale, hand_rule::periods * period)
                                          : hand_rule::stale;
    }

    bool far(const Twist& t) const noexcept {
        return norm(t.linear) > options_.jump || norm(t.angular) > options_.turn;
    }

    bool is_jump(const Pose<double>& sample, double dt) const noexcept {
        return options_.patience > 0 && far(difference(moved_by(pose_, velocity_ * dt), sample));
    }

    /// A sample that jumped: waited for, until it has stayed where it is for long enough.
    bool doubt(const Pose<double>& sample, double dt) noexcept {
        const bool stays = suspected_ > 0 && !far(difference(suspect_, sample));
        suspected_ = stays ? suspected_ + age_ : dt;
        suspect_ = sample;
        remember(sample);
        if (suspected_ < options_.patience) {
            wait(dt);
            told_ = pose_;
        } else {
            start(sample);
        }
        return false;
    }

    /// No sample to believe: on as predicted, slowing down.
    bool wait(double dt) noexcept {
        held_ = true;
        since_ += dt;
        pose_ = moved_by(pose_, velocity_ * dt);
        velocity_ = velocity_ * std::exp(-dt / hand_rule::slowing);
        acceleration_ = Twist{};
        return false;
    }

    /// Where the sample says, whatever was predicted while none came.
    bool rest_plain() noexcept {
        pose_ = told_;
        if (age_ > 2.0 * period_) velocity_ = acceleration_ = Twist{};
        return false;
    }

    /// Taken as it comes; the velocity is that between the last two samples, less where they tremble.
    void take(const Pose<double>& sample) noexcept {
        const Twist speed = difference(told_, sample) * (1.0 / age_);
        const bool possible =
            norm(speed.linear) < hand_rule::fastest && norm(speed.angular) < hand_rule::fastest;
        velocity_ = possible ? speed * believed(speed) : Twist{};
        period_ = age_;
        pose_ = sample;
    }

    /// The share of the velocity between two samples that is followed. A hand's velocity changes one way for
    /// many samples; what changes to and fro from one to the next is noise.
    double believed(const Twist& speed) noexcept {
        const auto size = [](const Twist& t) { return std::hypot(norm(t.linear), norm(t.angular)); };
        const Twist change = speed - measured_;
        measured_ = speed;
        drift_ = drift_ + (change - drift_) * hand_rule::newest;
        changes_ += (size(change) - changes_) * hand_rule::newest;
        const double tremble = max(changes_ - size(drift_), 0.0);
        const double share = hand_rule::calm / max(tremble, hand_rule::calm);
        return share * share;
    }

    /// Towards a sample. Where it is `repeated` the hand rests, and its velocity dies away; without that, and
    /// the bound on it, one that makes a whole turn between two looks would go on for ever.
    void blend(const Pose<double>& sample, double dt, bool repeated) noexcept {
        const Pose<double> predicted = moved_by(pose_, velocity_ * dt);
        const Twist rest = difference(predicted, sample);
        const double T = since_ + dt;
        settling_ = T > hand_rule::rare * dt ? hand_rule::settles * min(T, hand_rule::longest) : 0.0;
        const double a = std::exp(-estimating() * T);
        pose_ = moved_by(predicted, rest * (1.0 - a * a));
        const Twist now = (velocity_ + rest * ((1.0 - a) * (1.0 - a) / T)) * (repeated ? a : 1.0);
        velocity_ = {now.linear * possible(now.linear), now.angular * possible(now.angular)};
    }

    /// The share of a velocity that a hand may have.
    static double possible(const Vec3<double>& velocity) noexcept {
        return hand_rule::fastest / max(norm(velocity), hand_rule::fastest);
    }

    /// omega of the estimate: what settles on it smooths and lags too, so that it has less to do.
    double estimating() const noexcept {
        return options_.omega / max(hand_rule::least, 1.0 - hand_rule::shared * options_.omega * settling_);
    }

    void accelerate(const Twist& before, double dt) noexcept {
        const Twist change = (shown_velocity_ - before) * (1.0 / dt);
        acceleration_ = acceleration_ + (change - acceleration_) * -std::expm1(-dt / hand_rule::smooth);
    }

    void remember(const Pose<double>& sample) noexcept {
        sample_ = sample;
        told_ = pose_;
        age_ = 0;
        since_ = 0;
    }

    HandFilter options_;
    Pose<double> pose_ = identity_pose(), sample_ = identity_pose(), suspect_ = identity_pose();
    Pose<double> told_ = identity_pose();   // where the hand was when the sample changed
    Pose<double> shown_ = identity_pose();  // what is followed of the estimate
    Twist velocity_, shown_velocity_, acceleration_;
    Twist measured_, drift_;  // the last velocity between two samples, and the mean change of such ...
    double changes_ = 0;      // ... and of how much they change, m/s and rad/s
    double settling_ = 0;     // s in which what is shown settles on the estimate; 0: it is that
    double age_ = 0;          // s since the sample changed
    double since_ = 0;        // s since a sample was believed
    double period_ = 0;       // s between samples
    double changed_ = 0;      // s since the sample was another one ...
    double between_[2]{};     // ... and between such, the last two
    double suspected_ = 0;    // s that a jump has lasted
    bool held_ = false;
};

}  // namespace armangle

#include "../names/end.hpp"
