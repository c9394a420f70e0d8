"""Pages that lay out results in words."""
