"""The arm, and what it says of a pose: arcs, joint functions, branches, why not."""

from . import offset as offset  # a kind of arm, which `Arm` makes
