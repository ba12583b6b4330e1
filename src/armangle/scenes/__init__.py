"""Obstacles around an arm, and the collision model of its links."""
