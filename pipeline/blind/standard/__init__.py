"""The standard matrix of blind trials: made, asked, scored straight."""
