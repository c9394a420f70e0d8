"""What a log is worth before anything is computed from it."""
