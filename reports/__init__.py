"""Tables, figures and sidecars of results computed elsewhere."""
