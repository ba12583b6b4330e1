"""What an arm reaches: where to put it, and maps."""
