"""
Franka beside iiwa
==================

The same arc in space by two kinds of arm: arm angle of a KUKA iiwa 7, joint 7 of a Franka FR3.
"""

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
start, end = (aa.pose([0.45, y, 0.4], rpy=[0.0, 3.1416, 0.0]) for y in (0.2, -0.2))
for name, ax in zip(("kuka_iiwa7_r800", "franka_fr3"), axes, strict=True):
    arm = aa.Arm.load(name)
    path = aa.plan(arm, aa.CircularArc(start, [0.6, 0.0, 0.4], end))
    plots.feasible_map(path, gc=int(path.gc[0]), ax=ax)
    ax.set_title(f"{name}: {arm.redundancy}")
plt.show()
