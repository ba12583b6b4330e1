"""
The map of a path
=================

Every feasible arm angle along a line, coloured by the joint that forbids the rest, and the planned motion.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800")
q = np.array([1.59, 0.4, -1.12, -1.13, -1.26, 0.4, -1.38])
first = arm.forward(q)[0]
path = aa.plan(arm, aa.Line(first, aa.pose([0.0, -0.3, 0.0]) @ first), start=q, gc=2)
plots.feasible_map(path, gc=2)
plt.show()
