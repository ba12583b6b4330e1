"""
06. Obstacles as arcs
=====================

An obstacle that a link must not touch blocks arcs of the arm angle, exactly. An arm with a scene takes them
off its feasible arcs, and ``Repulsion`` then keeps away from the obstacle as it does from joint limits.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
start = np.radians([20.0, 45.0, 10.0, -80.0, 10.0, 60.0, 0.0])
first, psi, gc = arm.forward(start)
beside = arm.elbow(start)[:2] + np.array([-0.04, 0.18])  # a pole behind the elbow, on the side it moves to
pole = aa.Capsule([*beside, 0.0], [*beside, 1.2], 0.04, name="pole")
scene = aa.Scene([pole, aa.HalfSpace([0, 0, 1], 0.0, name="floor")], clearance=0.005)
guarded = arm.with_(scene=scene)

# %%
# The tool moves 18 cm to the side, with and without the scene.

poses = np.tile(first, (200, 1, 1))
poses[:, 1, 3] += np.linspace(0.0, 0.18, 200)
policy = aa.Repulsion(K=0.1, alpha=20)
free = aa.follow(arm, poses, start=start, policy=policy)
kept = aa.follow(guarded, poses, start=start, policy=policy)
for name, path in (("free", free), ("kept", kept)):
    near = guarded.clearance(path.q)
    at = int(np.argmin(near.distance))
    print(f"{name}: least distance {1e3 * near.distance[at]:.1f} mm, {near.link[at]} to {near.obstacle[at]}")
assert kept.ok
assert (guarded.clearance(kept.q).distance > 0.005 - 1e-9).all()

# %%
# What is left of the circle at the end, and who ends it.

last = guarded.feasible(poses[-1], gc)
for end in last.ends[0]:
    print(f"{end.obstacle} touches {end.link}" if end.obstacle else f"joint {end.joint}, {end.side} limit")
plots.circle(guarded, poses[-1], gc, psi=float(kept.psi[-1]))
plt.show()
