"""Where an arm comes from: files of robots, the catalogue, and the numbers found in them. Knows no `Arm`."""
