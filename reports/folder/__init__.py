"""A folder of results: one run at a time, replaced as a whole."""
