"""One file per subject; each function takes plain results and returns a Figure."""
