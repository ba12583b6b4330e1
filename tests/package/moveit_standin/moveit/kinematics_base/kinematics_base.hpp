// A STAND-IN, not MoveIt: the shape of the parts of moveit_core and its messages that contrib/moveit uses,
// written for its test from the documented interface. That the glue compiles here says nothing of its build
// against MoveIt.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace geometry_msgs::msg {
struct Point {
    double x = 0, y = 0, z = 0;
};
struct Quaternion {
    double x = 0, y = 0, z = 0, w = 1;
};
struct Pose {
    Point position;
    Quaternion orientation;
};
}  // namespace geometry_msgs::msg

namespace moveit_msgs::msg {
struct MoveItErrorCodes {
    static constexpr int SUCCESS = 1, TIMED_OUT = -6, NO_IK_SOLUTION = -31;
    int val = 0;
};
}  // namespace moveit_msgs::msg

namespace rclcpp {
struct Node {
    using SharedPtr = std::shared_ptr<Node>;
    std::map<std::string, double> numbers;
    std::map<std::string, std::vector<double>> lists;
};
}  // namespace rclcpp

namespace moveit::core {
struct VariableBounds {
    double min_position_ = 0, max_position_ = 0;
    bool position_bounded_ = false;
};
struct JointModel {
    std::string name;
    std::vector<VariableBounds> bounds;
    const std::string& getName() const { return name; }
    const std::vector<VariableBounds>& getVariableBounds() const { return bounds; }
};
struct JointModelGroup {
    std::vector<const JointModel*> active;
    const std::vector<const JointModel*>& getActiveJointModels() const { return active; }
};
struct RobotModel {
    JointModelGroup group;
    std::function<Eigen::Isometry3d(const std::vector<double>&)> tip;  // the chain that the test has
    /// The group "arm"; nullptr for any other name.
    const JointModelGroup* getJointModelGroup(const std::string& name) const {
        return name == "arm" ? &group : nullptr;
    }
};
using RobotModelConstPtr = std::shared_ptr<const RobotModel>;
}  // namespace moveit::core

namespace kinematics {
struct KinematicsQueryOptions {
    bool lock_redundant_joints = false, return_approximate_solution = false;
};

class KinematicsBase {
public:
    using Pose = geometry_msgs::msg::Pose;
    using Codes = moveit_msgs::msg::MoveItErrorCodes;
    using Values = std::vector<double>;
    using Options = KinematicsQueryOptions;
    using IKCallbackFn = std::function<void(const Pose&, const Values&, Codes&)>;

    virtual ~KinematicsBase() = default;
    virtual bool getPositionIK(const Pose&, const Values&, Values&, Codes&, const Options& = {}) const = 0;
    virtual bool searchPositionIK(const Pose&, const Values&, double, Values&, Codes&,
                                  const Options& = {}) const = 0;
    virtual bool searchPositionIK(const Pose&, const Values&, double, const Values&, Values&, Codes&,
                                  const Options& = {}) const = 0;
    virtual bool searchPositionIK(const Pose&, const Values&, double, Values&, const IKCallbackFn&, Codes&,
                                  const Options& = {}) const = 0;
    virtual bool searchPositionIK(const Pose&, const Values&, double, const Values&, Values&,
                                  const IKCallbackFn&, Codes&, const Options& = {}) const = 0;
    virtual bool getPositionFK(const std::vector<std::string>&, const Values&, std::vector<Pose>&) const = 0;
    virtual bool initialize(const rclcpp::Node::SharedPtr&, const moveit::core::RobotModel&,
                            const std::string&, const std::string&, const std::vector<std::string>&,
                            double) = 0;
    virtual const std::vector<std::string>& getJointNames() const = 0;
    virtual const std::vector<std::string>& getLinkNames() const = 0;
    virtual bool setRedundantJoints(const std::vector<unsigned int>& joints) {
        redundant_joint_indices_ = joints;
        return true;
    }

protected:
    void storeValues(const moveit::core::RobotModel& model, const std::string& group, const std::string& base,
                     const std::vector<std::string>& tips, double discretization) {
        robot_model_ = moveit::core::RobotModelConstPtr(&model, [](const moveit::core::RobotModel*) {});
        group_name_ = group;
        base_frame_ = base;
        tip_frames_ = tips;
        redundant_joint_discretization_ = discretization;
    }
    /// Writes the node's parameter to `to`, or `other` and returns false if it has none of the name.
    bool lookupParam(const rclcpp::Node::SharedPtr& node, const std::string& name, double& to, double other) {
        const auto at = node->numbers.find(name);
        to = at == node->numbers.end() ? other : at->second;
        return at != node->numbers.end();
    }
    bool lookupParam(const rclcpp::Node::SharedPtr& node, const std::string& name, Values& to,
                     const Values& other) {
        const auto at = node->lists.find(name);
        to = at == node->lists.end() ? other : at->second;
        return at != node->lists.end();
    }

    moveit::core::RobotModelConstPtr robot_model_;
    std::string group_name_, base_frame_;
    std::vector<std::string> tip_frames_;
    std::vector<unsigned int> redundant_joint_indices_;
    double redundant_joint_discretization_ = 0;
};
}  // namespace kinematics
