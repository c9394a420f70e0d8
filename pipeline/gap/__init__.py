"""From a measured log to a named effect and a smaller gap."""
