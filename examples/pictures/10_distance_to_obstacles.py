"""
Distance to an obstacle
=======================

The nearest distance over the whole elbow circle, and the interval in which the arm is collision-free.
"""

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800").with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
pose, psi, gc = arm.forward([0.35, 0.79, 0.17, -1.4, 0.17, 1.05, 0.0])
scene = aa.Scene([aa.Ball([0.28, 0.26, 0.6], 0.05, name="lamp")], clearance=0.01)
plots.clearance_profile(arm.with_(scene=scene), pose, gc, psi=psi)
plt.show()
