// A STAND-IN, not MoveIt: see kinematics_base.hpp beside it.
#pragma once

#include <moveit/kinematics_base/kinematics_base.hpp>

namespace moveit::core {
class RobotState {
public:
    explicit RobotState(const RobotModelConstPtr& model) : model_(model) {}
    void setJointGroupPositions(const JointModelGroup*, const std::vector<double>& q) { q_ = q; }
    void update() {}
    /// The identity for "base", otherwise the pose of the tip at the joints that are set.
    Eigen::Isometry3d getGlobalLinkTransform(const std::string& link) const {
        return link == "base" ? Eigen::Isometry3d::Identity() : model_->tip(q_);
    }

private:
    RobotModelConstPtr model_;
    std::vector<double> q_;
};
}  // namespace moveit::core
