"""
07. Batches
===========

Every function takes leading axes, and broadcasts as NumPy does.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
rng = np.random.default_rng(7)
q = rng.uniform(arm.lower, arm.upper, (10_000, 7))

with aa.threads(0):  # all cores
    pose, psi, gc = arm.forward(q)  # (10000, 4, 4), (10000,), (10000,)
    again = arm.inverse(pose, psi, gc)
print("largest pose error:", f"{np.abs(arm.forward(again)[0] - pose).max():.1e}")

# %%
# One pose, 360 arm angles, eight configurations: an array of (360, 8, 7) postures.

angles = np.radians(np.arange(-180, 180))
postures = arm.inverse(pose[0], angles, limits=False)
print(postures.shape, "within limits:", arm.within_limits(postures).sum(axis=0), "of 360, by gc")

# %%
# The same question, exact and without sampling: arcs of a batch. ``measure`` is their length in rad.

arcs = arm.feasible(pose[:1000, None], np.arange(8))  # shape (1000, 8)
print(arcs, "mean share by gc:", (arcs.measure.mean(axis=0) / (2 * np.pi)).round(3))
plt.hist(np.degrees(arcs.measure.max(axis=1)), bins=36)
plt.gca().set(xlabel="feasible part of the circle in the best configuration (deg)", ylabel="poses")
plt.show()

# %%
# Poses that may be out of reach: NaN instead of an exception, and never unasked.

far = pose[:5].copy()
far[::2, 0, 3] += 2.0
print(np.isnan(arm.inverse(far, 0.0, 0, on_error="nan")).all(axis=-1))

# %%
# An element's result does not depend on its neighbours, its place or the number of threads, bit for bit.

assert np.array_equal(again[123], arm.inverse(pose[123], psi[123], gc[123]))
