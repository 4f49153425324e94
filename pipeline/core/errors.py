"""The one error a user should ever see."""

_LONGEST = 1000  # characters; names and values out of a file may be of any length


class InputError(ValueError):
    """Input or options that cannot be used.

    The message is one sentence for the user: what was expected, what came, what to do. It often quotes a file, so that
    it is kept to one line of printable characters, and its middle is left out when it is long.
    The command line prints it and exits with code 2.
    """

    def __init__(self, message: str) -> None:
        shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(message.split()))
        if len(shown) > _LONGEST:
            shown = f"{shown[: _LONGEST - 303]} ... {shown[-298:]}"
        super().__init__(shown)
