"""Between battery and motor: drivers, battery, what is fed back, and the parts that do it."""
