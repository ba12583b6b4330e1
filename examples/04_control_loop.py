"""
04. A control loop
==================

One call of ``step`` each cycle: present joints and the next pose in, next joints out, or a status
that says why not.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa

arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
dt = 0.001
policy = aa.Repulsion(rate=2.0, alpha=20)  # a rate per second: the same motion at any cycle time
fastest = np.deg2rad(85.0)

q = np.radians([10.0, 40.0, 0.0, -80.0, 0.0, 60.0, 0.0])
centre = arm.forward(q)[0]


def target(t: float) -> np.ndarray:
    """The tool on a circle of 0.1 m, once in 4 s."""
    pose = centre.copy()
    pose[:2, 3] += 0.1 * np.array([np.sin(np.pi * t / 2), 1.0 - np.cos(np.pi * t / 2)])
    return pose


# %%
# No exception is raised on geometry. On any status but OK the posture returned is the present one.

visited = [q]
for cycle in range(4000):
    now = aa.step(
        arm, q, target((cycle + 1) * dt), policy=policy, dt=dt, carry="elbow", max_joint_step=fastest * dt
    )
    if now.status != aa.Status.OK:
        print(f"{cycle * dt:.3f} s: {now.status.sentence}")
        break
    q = now.q
    visited.append(q)

print("least distance to a limit:", np.degrees(arm.limit_margin(visited).min()).round(1), "deg")
assert now.status == aa.Status.OK

# %%
# A pose out of reach:

away = centre.copy()
away[0, 3] += 1.0
print(aa.step(arm, q, away).status.sentence)

# %%
# The joints over time:

plt.plot(dt * np.arange(len(visited)), np.degrees(visited), label=[f"q{i}" for i in range(1, 8)])
plt.gca().set(xlabel="time (s)", ylabel="joint (deg)")
plt.legend()
plt.show()
