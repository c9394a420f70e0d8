"""Joint demand, ground forces, stability."""
