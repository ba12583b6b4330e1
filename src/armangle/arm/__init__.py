"""The arm and its queries about a pose: arcs, joint functions, branches, diagnosis."""

from . import offset as offset  # an arm kind that `Arm` creates
