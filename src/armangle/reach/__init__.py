"""Reachability: base placement, and maps."""
