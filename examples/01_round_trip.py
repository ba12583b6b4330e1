"""
01. Forward and inverse
=======================

Joints give a pose, an arm angle and a configuration; these three give the joints back.
"""

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
q = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])

pose, psi, gc = arm.forward(q)
print(f"psi = {np.degrees(psi):.4f} deg, gc = {gc}")

again = arm.inverse(pose, psi, gc)
print(f"largest difference of a joint: {np.abs(again - q).max():.1e} rad")
assert np.allclose(again, q, atol=1e-9)

# %%
# The other arm angles of the same pose and configuration: the tool stays, the elbow moves.

angles = np.linspace(-np.pi, np.pi, 9)
postures = arm.inverse(pose, angles, gc, limits=False)  # (9, 7)
assert np.allclose(arm.forward(postures)[0], pose)
for angle, posture in zip(angles, postures, strict=True):
    print(f"psi {np.degrees(angle):7.1f}:", np.degrees(posture).round(1), arm.within_limits(posture))

# %%
# The eight configurations of this pose and arm angle. Row k is always gc = k.

for k, posture in enumerate(arm.inverse(pose, psi, limits=False)):
    print(k, aa.gc_signs(k), np.degrees(posture).round(1), arm.within_limits(posture))

# %%
# Real and virtual arm, and the angle between them:

plots.virtual_arm(arm, q)
plt.show()
