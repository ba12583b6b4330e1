"""When: a path of joints with times, speeds and accelerations."""
