"""How an arm moves: paths of the tool, steps, sequences of steps, whole plans."""
