// contrib/moveit asked what MoveIt asks, against headers that stand in for MoveIt's. Prints "right" and
// "wrong" with how many checks were so (wrong must be 0).
#include <cstdio>
#include <optional>

#include "../../../contrib/moveit/src/kinematics_plugin.cpp"

namespace {

using armangle_moveit::KinematicsPlugin;
using Values = std::vector<double>;

/// The pose in Eigen's type.
Eigen::Isometry3d frame(const armangle::Pose<double>& p) {
    const auto& [x, y, z] = p.rotation;
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.linear() << x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z;
    out.translation() << p.position.x, p.position.y, p.position.z;
    return out;
}

/// The largest distance of one joint (rad).
double farthest(const Values& a, const Values& b) {
    double out = 0;
    for (std::size_t j = 0; j < a.size(); ++j) out = std::fmax(out, std::fabs(a[j] - b[j]));
    return out;
}

}  // namespace

/// Asks the plugin what MoveIt asks, and prints how many answers are right and wrong.
int main() {
    const double range[7] = {2.96, 2.09, 2.96, 2.09, 2.96, 2.09, 3.05};
    armangle::ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    const armangle::Arm arm = armangle::make_arm(p);
    moveit::core::JointModel joint[7];
    moveit::core::RobotModel model;
    for (int j = 0; j < 7; ++j) {
        joint[j] = {"joint_" + std::to_string(j + 1), {{-range[j], range[j], true}}};
        model.group.active.push_back(&joint[j]);
    }
    model.tip = [&arm](const Values& q) { return frame(armangle::forward(arm, q.data()).pose); };
    const auto node = std::make_shared<rclcpp::Node>();
    node->numbers = {{"d_bs", 0.34}, {"d_se", 0.4}, {"d_ew", 0.4}, {"d_wf", 0.126}};
    int right = 0, wrong = 0;
    const auto check = [&](bool good, const char* what) {
        ++(good ? right : wrong);
        if (!good) std::fprintf(stderr, "wrong: %s\n", what);
    };
    KinematicsPlugin plugin;
    check(plugin.initialize(node, model, "arm", "base", {"tip"}, 0.02), "initialize");
    check(plugin.getJointNames().size() == 7 && plugin.getLinkNames().size() == 1, "names");
    KinematicsPlugin other;
    check(!other.initialize(node, model, "leg", "base", {"tip"}, 0.02), "another group");
    node->numbers["d_se"] = 0.41;
    check(!other.initialize(node, model, "arm", "base", {"tip"}, 0.02), "numbers of another arm");

    const Values q{0.3, 0.6, -0.4, -1.2, 0.5, 0.9, 0.2}, seed{0.2, 0.7, -0.2, -1.1, 0.4, 0.8, 0.4};
    std::vector<geometry_msgs::msg::Pose> poses;
    check(plugin.getPositionFK({"tip"}, q, poses) && poses.size() == 1, "forward");
    check(!plugin.getPositionFK({"hand"}, q, poses), "an unknown link");
    plugin.getPositionFK({"tip"}, q, poses);
    moveit_msgs::msg::MoveItErrorCodes code;
    const auto holds = [&](const Values& at) {
        const auto off =
            difference(armangle::forward(arm, at.data()).pose, armangle::forward(arm, q.data()).pose);
        return at.size() == 7 && size(off, 1.0) < 1e-9;
    };
    Values found;
    check(plugin.getPositionIK(poses[0], seed, found, code) && holds(found) && code.val == code.SUCCESS,
          "nearest");
    check(farthest(found, seed) <= 0.3, "near the seed");
    check(!plugin.getPositionIK(poses[0], Values(6), found, code) && code.val == code.NO_IK_SOLUTION,
          "six joints");
    check(plugin.searchPositionIK(poses[0], seed, 1.0, Values(7, 0.3), found, code) && holds(found),
          "consistency");
    check(!plugin.searchPositionIK(poses[0], seed, 1.0, Values(7, 1e-3), found, code), "no room");
    int asked = 0;
    const auto third = [&](const geometry_msgs::msg::Pose&, const Values&,
                           moveit_msgs::msg::MoveItErrorCodes& c) {
        c.val = ++asked == 3 ? c.SUCCESS : c.NO_IK_SOLUTION;
    };
    check(plugin.searchPositionIK(poses[0], seed, 1.0, found, third, code) && holds(found) && asked == 3,
          "callback");
    const auto never = [&](const geometry_msgs::msg::Pose&, const Values&,
                           moveit_msgs::msg::MoveItErrorCodes& c) {
        ++asked;
        c.val = c.NO_IK_SOLUTION;
    };
    asked = 0;
    check(!plugin.searchPositionIK(poses[0], seed, 1e9, found, never, code) && asked > 100,
          "a search that ends");
    check(code.val == code.NO_IK_SOLUTION && found.empty(), "nothing is left of it");
    check(!plugin.searchPositionIK(poses[0], seed, -1.0, found, never, code) && code.val == code.TIMED_OUT,
          "late");
    kinematics::KinematicsQueryOptions options;
    options.lock_redundant_joints = true;
    plugin.setRedundantJoints({2});
    Values at_joint = seed;
    at_joint[2] = q[2];
    check(plugin.getPositionIK(poses[0], at_joint, found, code, options) && holds(found), "joint 3 held");
    check(std::fabs(found[2] - q[2]) < 1e-7, "joint 3 stays");
    options = {};
    geometry_msgs::msg::Pose far = poses[0];
    far.position.x = 5.0;
    check(!plugin.getPositionIK(far, seed, found, code, options) && found.empty(), "out of reach");
    options.return_approximate_solution = true;
    check(plugin.getPositionIK(far, seed, found, code, options) && found.size() == 7, "approximate");
    std::printf("right %d\nwrong %d\n", right, wrong);
}
