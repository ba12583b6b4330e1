"""
08. Around a dead end
=====================

On this line the elbow must make up its mind early. ``Repulsion`` looks at one pose at a time: it keeps away
from the ends of the arc that it is in, until that arc closes. ``plan`` sees the whole path.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
start = np.array([1.59, 0.4, -1.12, -1.13, -1.26, 0.4, -1.38])
first = arm.forward(start)[0]
last = first.copy()
last[1, 3] -= 0.3
line = aa.Line(first, last)
poses = line.pose(np.linspace(0, 1, 201))

# %%
# Step by step, whichever way the arm angle is carried from pose to pose: a joint limit.

for carry in ("psi", "elbow"):
    stepped = aa.follow(arm, poses, start=start, carry=carry, policy=aa.Repulsion(outside="stop"))
    print(f"follow, {carry} carried:", stepped.explain())
    assert not stepped.ok

# %%
# The whole path at once, from the same posture: proven between the poses, far from every limit.

planned = aa.plan(arm, poses, start=start)
print("plan:", planned.explain(), f"least margin {np.degrees(planned.margin.min()):.1f} deg")
assert planned.certified

# %%
# Both curves in the map of feasible arm angles.

plots.feasible_map(stepped, gc=int(planned.gc[0]))
plots.feasible_map(planned, gc=int(planned.gc[0]))
plt.show()
