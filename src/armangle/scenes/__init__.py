"""What stands about an arm, and what its links look like."""
