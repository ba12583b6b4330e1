"""Timing: joint paths with times, velocities and accelerations."""
