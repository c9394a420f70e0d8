"""A whole machine at once: bodies, friction of every joint and couplings fitted together."""
