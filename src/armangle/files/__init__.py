"""Files: tables of poses and joints as CSV, NPZ and JSON."""
