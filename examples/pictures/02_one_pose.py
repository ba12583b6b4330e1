"""
One pose, many joint configurations
===================================

The end effector stays still while the elbow moves on its circle: four of infinitely many solutions.
"""

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800")
pose, psi, gc = arm.forward([0.3, 0.5, 0.2, -1.2, 0.3, 0.6, 0.0])
figure = plt.figure(figsize=(10, 9))
for place, turn in enumerate((0.0, 0.6, 1.2, 1.8), 1):
    ax = figure.add_subplot(2, 2, place, projection="3d")
    plots.stick_figure(arm, arm.inverse(pose, psi - turn, gc), ax=ax)
plt.show()
