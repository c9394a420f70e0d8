"""What can be wrong with what a regression is given."""


class RegressionError(ValueError):
    """The rows, the model or an option do not allow an identification; the message says why."""
