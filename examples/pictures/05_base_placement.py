"""
Where to put the robot
======================

Base positions that reach all ten poses of a task, and the best direction of the base at each.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800")
task = [aa.pose([0.1 * k, 0.3, 0.4], rpy=[0.0, np.pi, 0.0]) for k in range(10)]
found = aa.place(arm, task, np.linspace(-0.6, 1.5, 85), np.linspace(-0.6, 1.2, 73))
plots.placement(found)
plt.show()
