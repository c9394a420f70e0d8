"""Results as tables, one module per mode of operation."""
