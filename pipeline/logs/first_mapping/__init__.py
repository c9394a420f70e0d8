"""A first mapping file for a foreign log, by its header, its units and what the motion shows."""
