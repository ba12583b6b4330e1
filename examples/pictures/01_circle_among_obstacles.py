"""
The elbow circle among obstacles
================================

One ring for each joint limit and each obstacle; the band outside is what remains feasible.
"""

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800").with_(body="guessed")
pose, psi, gc = arm.forward([0.35, 0.79, 0.17, -1.4, 0.17, 1.05, 0.0])
lamp = aa.Ball([0.28, 0.26, 0.6], 0.05, name="lamp")
shelf = aa.Box(aa.pose([0.5, -0.5, 0.6]), [0.4, 0.3, 0.02], name="shelf")
plots.circle(arm.with_(scene=aa.Scene([lamp, shelf])), pose, gc, psi=psi)
plt.show()
