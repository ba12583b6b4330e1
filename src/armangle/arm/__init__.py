"""The arm, and what it says of a pose: arcs, joint functions, branches, why not."""
