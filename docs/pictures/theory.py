"""Pictures of the theory pages."""

PICTURES = {}
