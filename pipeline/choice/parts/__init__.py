"""Parts as numbers: every compatible design, and ranges for what no sheet prints."""
