"""Origins of an arm: robot files, the catalogue, and the numbers read from them. Independent of `Arm`."""
