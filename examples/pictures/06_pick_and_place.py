"""
Pick and place
==============

Down, up, across and down again: one certified path with blended corners, timed with bounded jerk.
"""

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

arm = aa.Arm.load("kuka_iiwa7_r800")
pick, place = (aa.pose([0.5, y, 0.2], rpy=[0.0, 3.1416, 0.0]) for y in (-0.3, 0.3))
above = [aa.pose([0, 0, 0.25]) @ pose for pose in (pick, place)]
moves = [aa.Line(a, b) for a, b in zip([pick, *above], [*above, place], strict=True)]
path = aa.plan(arm, aa.Segments(moves, blend=0.05))
plots.trajectory(aa.retime(path, acceleration=5.0, jerk=50.0))
plt.show()
