"""One file per kind of figure; each function takes plain results and returns a Figure."""
