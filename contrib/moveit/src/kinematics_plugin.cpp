// armangle as a kinematics plugin of MoveIt 2: glue around armangle/search.hpp.
//
// Not built against MoveIt: where armangle is developed there is none. It is compiled and run there against
// headers that stand in for MoveIt's (tests/package/moveit_standin); see README.md beside it.
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include <armangle/search.hpp>
#if __has_include(<moveit/kinematics_base/kinematics_base.hpp>)
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_state/robot_state.hpp>
#else
#include <moveit/kinematics_base/kinematics_base.h>
#include <moveit/robot_state/robot_state.h>
#endif
#include <pluginlib/class_list_macros.hpp>

namespace armangle_moveit {

using armangle::joints;
using PoseMessage = geometry_msgs::msg::Pose;
using ErrorCodes = moveit_msgs::msg::MoveItErrorCodes;
using Values = std::vector<double>;
using kinematics::KinematicsQueryOptions;
using RowByRow = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;

namespace {

armangle::Pose<double> from_matrix(const Eigen::Matrix4d& m) {
    const auto column = [&m](int k) { return armangle::Vec3<double>{m(0, k), m(1, k), m(2, k)}; };
    return {{column(0), column(1), column(2)}, column(3)};
}

armangle::Pose<double> from_message(const PoseMessage& p) {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    const auto& o = p.orientation;
    out.linear() = Eigen::Quaterniond(o.w, o.x, o.y, o.z).normalized().toRotationMatrix();
    out.translation() = Eigen::Vector3d(p.position.x, p.position.y, p.position.z);
    return from_matrix(out.matrix());
}

PoseMessage to_message(const armangle::Pose<double>& pose) {
    const auto& [x, y, z] = pose.rotation;
    Eigen::Matrix3d rotation;
    rotation << x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z;
    const Eigen::Quaterniond o(rotation);
    PoseMessage out;
    out.position.x = pose.position.x;
    out.position.y = pose.position.y;
    out.position.z = pose.position.z;
    out.orientation.x = o.x();
    out.orientation.y = o.y();
    out.orientation.z = o.z();
    out.orientation.w = o.w();
    return out;
}

}  // namespace

class KinematicsPlugin : public kinematics::KinematicsBase {
public:
    bool initialize(const rclcpp::Node::SharedPtr& node, const moveit::core::RobotModel& model,
                    const std::string& group_name, const std::string& base_frame,
                    const std::vector<std::string>& tip_frames, double search_discretization) override {
        storeValues(model, group_name, base_frame, tip_frames, search_discretization);
        const moveit::core::JointModelGroup* group = model.getJointModelGroup(group_name);
        if (!group || tip_frames.size() != 1 || group->getActiveJointModels().size() != joints) return false;
        armangle::ArmParameters p;
        Values base(16), tool(16), signs, offsets;
        const auto number = [&](const char* name, double& to) { lookupParam(node, name, to, 0.0); };
        number("d_bs", p.d_bs);
        number("d_se", p.d_se);
        number("d_ew", p.d_ew);
        number("d_wf", p.d_wf);
        number("a_3", p.a_3);
        number("a_4", p.a_4);
        number("d_4", p.d_4);
        number("singularity_margin", options_.singularity_margin);
        lookupParam(node, "radian_length", radian_length_, 0.5);
        const Values identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        lookupParam(node, "base", base, identity);
        lookupParam(node, "tool", tool, identity);
        lookupParam(node, "signs", signs, Values(joints, 1.0));
        lookupParam(node, "offsets", offsets, Values(joints, 0.0));
        if (base.size() != 16 || tool.size() != 16 || signs.size() != joints || offsets.size() != joints)
            return false;
        p.base = from_matrix(RowByRow(base.data()));
        p.tool = from_matrix(RowByRow(tool.data()));
        joint_names_.clear();
        for (std::size_t j = 0; j < joints; ++j) {
            const auto* joint = group->getActiveJointModels()[j];
            const auto& bounds = joint->getVariableBounds()[0];
            p.sign[j] = signs[j];
            p.offset[j] = offsets[j];
            if (bounds.position_bounded_) p.limits.lower[j] = bounds.min_position_;
            if (bounds.position_bounded_) p.limits.upper[j] = bounds.max_position_;
            joint_names_.push_back(joint->getName());
        }
        link_names_ = tip_frames;
        if (search_discretization > 0) options_.resolution = search_discretization;
        arm_.emplace(armangle::make_arm(p));
        return is_of(*group);  // wrong numbers are refused here, and never give a wrong answer later
    }

    bool getPositionIK(const PoseMessage& pose, const Values& seed, Values& solution, ErrorCodes& error,
                       const KinematicsQueryOptions& options = {}) const override {
        return answer(pose, seed, never, {}, solution, {}, error, options);
    }
    bool searchPositionIK(const PoseMessage& pose, const Values& seed, double timeout, Values& solution,
                          ErrorCodes& error, const KinematicsQueryOptions& options = {}) const override {
        return answer(pose, seed, timeout, {}, solution, {}, error, options);
    }
    bool searchPositionIK(const PoseMessage& pose, const Values& seed, double timeout,
                          const Values& consistency, Values& solution, ErrorCodes& error,
                          const KinematicsQueryOptions& options = {}) const override {
        return answer(pose, seed, timeout, consistency, solution, {}, error, options);
    }
    bool searchPositionIK(const PoseMessage& pose, const Values& seed, double timeout, Values& solution,
                          const IKCallbackFn& callback, ErrorCodes& error,
                          const KinematicsQueryOptions& options = {}) const override {
        return answer(pose, seed, timeout, {}, solution, callback, error, options);
    }
    bool searchPositionIK(const PoseMessage& pose, const Values& seed, double timeout,
                          const Values& consistency, Values& solution, const IKCallbackFn& callback,
                          ErrorCodes& error, const KinematicsQueryOptions& options = {}) const override {
        return answer(pose, seed, timeout, consistency, solution, callback, error, options);
    }

    bool getPositionFK(const std::vector<std::string>& links, const Values& q,
                       std::vector<PoseMessage>& poses) const override {
        if (links != link_names_ || q.size() != joints || !arm_) return false;
        poses = {to_message(armangle::forward(*arm_, q.data()).pose)};
        return true;
    }

    const std::vector<std::string>& getJointNames() const override { return joint_names_; }
    const std::vector<std::string>& getLinkNames() const override { return link_names_; }

private:
    static constexpr double never = std::numeric_limits<double>::infinity();
    static constexpr double same = 1e-5;  // m, a radian counting as 1 m: the robot's own chain and the arm

    /// Whether the arm has the poses of the robot's own chain.
    bool is_of(const moveit::core::JointModelGroup& group) const {
        moveit::core::RobotState state(robot_model_);
        Values q(joints);
        for (int k = 0; k < 20; ++k) {
            for (std::size_t j = 0; j < joints; ++j)
                q[j] = armangle::middle(arm_->limits, static_cast<int>(j)) +
                       std::sin(static_cast<double>(j + 2) * (k + 1));
            state.setJointGroupPositions(&group, q);
            state.update();
            const Eigen::Isometry3d base = state.getGlobalLinkTransform(base_frame_);
            const Eigen::Isometry3d tip = base.inverse() * state.getGlobalLinkTransform(tip_frames_[0]);
            const auto apart = difference(armangle::forward(*arm_, q.data()).pose, from_matrix(tip.matrix()));
            if (!(size(apart, 1.0) < same)) return false;
        }
        return true;
    }

    bool answer(const PoseMessage& pose, const Values& seed, double timeout, const Values& consistency,
                Values& solution, const IKCallbackFn& callback, ErrorCodes& error,
                const KinematicsQueryOptions& asked) const {
        error.val = ErrorCodes::NO_IK_SOLUTION;
        const bool usable = arm_ && seed.size() == joints;
        if (!usable || (!consistency.empty() && consistency.size() != joints)) return false;
        armangle::SearchOptions options = options_;
        options.seed = seed.data();
        options.consistency = consistency.empty() ? nullptr : consistency.data();
        if (asked.lock_redundant_joints)
            for (const unsigned joint : redundant_joint_indices_) options.held |= 1u << joint;
        if (asked.return_approximate_solution) options.length = radian_length_;
        using Clock = std::chrono::steady_clock;
        const auto begin = Clock::now();
        bool late = false;
        const auto accept = [&](const double* q) {
            solution.assign(q, q + joints);
            if (!callback) return armangle::Answer::accepted;
            callback(pose, solution, error);
            if (error.val == ErrorCodes::SUCCESS) return armangle::Answer::accepted;
            late = std::chrono::duration<double>(Clock::now() - begin).count() > timeout;
            return late ? armangle::Answer::stop : armangle::Answer::refused;
        };
        const armangle::Found found = armangle::search(*arm_, from_message(pose), options, accept);
        const bool given = !std::isnan(found.posture.q[0]);
        error.val = given ? ErrorCodes::SUCCESS : ErrorCodes::NO_IK_SOLUTION;
        if (late) error.val = ErrorCodes::TIMED_OUT;
        if (!given) solution.clear();
        return given;
    }

    std::optional<armangle::Arm> arm_;
    armangle::SearchOptions options_;
    double radian_length_ = 0.5;  // m that a radian counts as, of approximate answers
    std::vector<std::string> joint_names_, link_names_;
};

}  // namespace armangle_moveit

PLUGINLIB_EXPORT_CLASS(armangle_moveit::KinematicsPlugin, kinematics::KinematicsBase)
