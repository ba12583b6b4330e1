"""
03. Follow a line
=================

A quarter of a metre along the tool's z axis, from a posture near the limits, with the elbow moving away from
them.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
start = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
pose = arm.forward(start)[0]
poses = np.tile(pose, (251, 1, 1))
poses[:, :3, 3] += np.linspace(0.0, 0.25, 251)[:, None] * pose[:3, 2]

# %%
# Different alpha, the same K.

runs = {
    f"alpha = {alpha}": aa.follow(arm, poses, start=start, policy=aa.Repulsion(K=0.1, alpha=alpha))
    for alpha in (5, 20, 100)
}
for name, run in runs.items():
    print(f"{name:12}", run.explain(), f"least margin {np.degrees(run.margin.min()):.2f} deg")
    assert run.ok

plots.path(runs)

# %%
# Below the curve, the map it moves in: for every pose of the line, which arm angles are feasible.

plots.feasible_map(runs["alpha = 20"], gc=3)
plt.show()
