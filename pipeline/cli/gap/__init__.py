"""The verb `gap`: options, what it writes, what it says."""
