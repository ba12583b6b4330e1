"""
02. Feasible arcs, and what ends them
=====================================

Which arm angles keep all joints within their limits, and which joint says no where?
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
pose, psi, gc = arm.forward(np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812]))

arcs = arm.feasible(pose, gc)
for (lower, upper), ends in zip(arcs, arcs.ends, strict=True):
    print(f"[{np.degrees(lower):7.2f}, {np.degrees(upper):7.2f}] deg")
    for end in ends:
        print(f"    ends where joint {end.joint} meets its {end.side} limit, {np.degrees(end.value):.0f} deg")

# %%
# Every end is exact: the joint is at its limit there.

for interval, ends in zip(arcs, arcs.ends, strict=True):
    for at, end in zip(interval, ends, strict=True):
        assert abs(arm.inverse(pose, at, gc)[end.joint - 1] - end.value) < 1e-11

# %%
# A set can be asked, and it is a value: intersect, unite, complement.

print(psi in arcs, arcs.nearest(0.6), np.degrees(arcs.measure).round(2))
each = arm.feasible(pose, gc, per_joint=True)
print("arcs of joint 5 alone:", each[4])

# %%
# A margin from singular postures narrows the arcs; its ends say "singular".

careful = arm.with_(singularity_margin=np.radians(10.0)).feasible(pose, gc)
print([(end.joint, end.side) for ends in careful.ends for end in ends])

plots.circle(arm, pose, gc, psi=psi)

# %%
# The same joints as functions of the arm angle, with their limits:

plots.joint_profiles(arm, pose, gc, psi=psi)
plt.show()
