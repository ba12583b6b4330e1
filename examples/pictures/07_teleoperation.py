"""
Teleoperation
=============

A target that moves by hand and jumps once; the tracker follows within its velocity and acceleration bounds.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.load("openarm_v10")
q = np.array([0.2, 0.5, 0.3, 1.2, 0.1, 0.3, 0.2])
targets = np.tile(arm.forward(q)[0], (500, 1, 1))
targets[:, 0, 3] += 0.08 * np.sin(np.linspace(0.0, 6.0, 500))
targets[250:, 2, 3] += 0.1
tracker = aa.Tracker(arm, dt=0.01, acceleration=20.0).start(q)
plots.tracking([tracker.step(target) for target in targets], dt=0.01)
plt.show()
