"""
06. Obstacles as arcs
=====================

An obstacle that the elbow must not touch blocks arcs of the arm angle. ``allowed=`` intersects what is left
with the feasible arcs, and ``Repulsion`` then keeps away from the obstacle as it does from joint limits.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
start = np.radians([20.0, 45.0, 10.0, -80.0, 10.0, 60.0, 0.0])
first, psi, gc = arm.forward(start)
wall = arm.frames(start)[3, 1, 3] + 0.02  # a wall 2 cm beside the elbow: its y must stay below


def beside_the_wall(pose: np.ndarray) -> aa.ArcSet:
    """Arm angles whose elbow stays on our side. On the circle the elbow's y is a sin + b cos + c."""
    c, b, a = (arm.frames(arm.inverse(pose, at, gc))[3, 1, 3] for at in (np.pi, 0.0, np.pi / 2))
    c, b = (b + c) / 2, (b - c) / 2
    a -= c
    size = np.hypot(a, b)
    half = np.arccos(np.clip((c - wall) / size, -1.0, 1.0))  # where a sin + b cos + c <= wall
    middle = np.arctan2(a, b) + np.pi
    return aa.ArcSet([[middle - half, middle + half]])


# %%
# The tool moves 18 cm towards the wall and past it, with and without ``allowed=``.

poses = np.tile(first, (200, 1, 1))
poses[:, 1, 3] += np.linspace(0.0, 0.18, 200)
policy = aa.Repulsion(K=0.1, alpha=20)
free = aa.follow(arm, poses, start=start, policy=policy)
kept = aa.follow(arm, poses, start=start, policy=policy, allowed=beside_the_wall)
for name, path in (("free", free), ("kept", kept)):
    elbow = arm.frames(path.q)[:, 3, 1, 3]
    print(
        f"{name}: the elbow comes {1e3 * (wall - elbow).min():.1f} mm near to the wall (negative: through it)"
    )
assert kept.ok
assert (arm.frames(kept.q)[:, 3, 1, 3] <= wall + 1e-9).all()

plots.circle(arm, poses[-1], gc, psi=float(kept.psi[-1]), allowed=beside_the_wall(poses[-1]))
plt.show()
