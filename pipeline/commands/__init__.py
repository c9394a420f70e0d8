"""The command line: options and printing; no computation."""
