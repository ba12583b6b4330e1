"""Motion of an arm: paths of the end effector, steps, sequences of steps, whole plans."""
