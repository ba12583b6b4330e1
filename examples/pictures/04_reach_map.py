"""
What an arm reaches
===================

For each position of the wrist, how many of the eight branches hold it, as a mean over all directions.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import armangle as aa
from armangle import plots

found = aa.reach_map(aa.Arm.load("openarm_v10"), Path(mkdtemp(), "map"), spacing=0.04)
plots.reach(found)
plt.show()
