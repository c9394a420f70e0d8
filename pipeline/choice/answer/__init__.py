"""What a choice tells: full chains, tables, lines, break-even."""
