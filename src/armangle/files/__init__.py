"""What is written and read: tables of poses and joints as CSV, NPZ and JSON."""
