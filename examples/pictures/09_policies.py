"""
Three ways to use the redundancy
================================

The same line with the arm angle held, centred in its interval, and repelled from the limits.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800")
q = [0.3, 0.6, 0.2, -1.3, 0.3, 0.8, 0.0]
line = aa.Line(arm.forward(q)[0], aa.pose([0.1, -0.35, 0.1]) @ arm.forward(q)[0])
rules = {"hold": aa.Hold(), "centre": aa.Centre(), "repel": aa.Repulsion(K=0.2, alpha=10)}
paths = {
    name: aa.follow(arm, line.pose(np.linspace(0.0, 1.0, 200)), start=q, policy=rule)
    for name, rule in rules.items()
}
plots.path(paths)
plt.show()
