"""From a measured log to named effects in a model file."""
