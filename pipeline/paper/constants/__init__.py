"""The motor's constants: what the paper's tables and the data sheet say of them."""
