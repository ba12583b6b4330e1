"""
05. An arm from a URDF
======================

The file here is written by the library itself, so that the example needs no robot package; any URDF
whose seven joints form an S-R-S arm will do.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import armangle as aa
from armangle import plots

text = aa.Arm.from_catalogue("schunk_lwa4d").to_urdf()
print(text[:400], "...")

file = Path(tempfile.mkdtemp()) / "robot.urdf"
file.write_text(text)

# %%
# Base and tip may be left out where the file leaves one choice. Joint values mean what they mean in the file.

arm = aa.Arm.from_urdf(file)
report = arm.report
assert report is not None  # an arm of the catalogue has none
has = arm.geometry
lengths = has.d_bs, has.d_se, has.d_ew, has.d_wf
print(f"{report.base} to {report.tip}: lengths {lengths} m, signs {has.signs}")
print(f"worst difference from the file's own kinematics: {report.residual_position:.1e} m")

q = np.radians([20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0])
assert np.allclose(arm.inverse(*arm.forward(q)), q)
plots.arm_frames(arm, q)
plt.show()

# %%
# An arm that is not S-R-S is read as what it is. Here the wrist is moved apart by 88 mm: joint 7 is then what
# ``psi`` is. Where the axes miss in other ways too, the error says which, and by how much.

lines = text.splitlines()
at = next(i for i, line in enumerate(lines) if f'name="{arm.geometry.joint_names[6]}"' in line)
origin = next(i for i in range(at, len(lines)) if "<origin" in lines[i])
lines[origin] = lines[origin].replace('xyz="0 ', 'xyz="0.088 ', 1).replace('xyz="0.0 ', 'xyz="0.088 ', 1)
moved = aa.Arm.from_urdf("\n".join(lines))
print(moved.kind, moved.redundancy, f"{1e3 * moved.geometry.a_6:.0f} mm")
assert np.allclose(moved.inverse(*moved.forward(q)), q)
