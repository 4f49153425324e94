"""The one error a user should ever see."""


class InputError(ValueError):
    """Input or options that cannot be used.

    The message is one sentence for the user: what was expected, what came, what to do.
    The command line prints it and exits with code 2.
    """
