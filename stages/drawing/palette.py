"""The colours of pages, images and recordings. Orange is the person's right, blue the left, grey what has no side.

Near the vermilion and blue of Okabe and Ito's palette ("Color Universal Design", 2008), told apart by every common
kind of colour vision, in shades that stand out on white paper as well as in the viewer's dark window.
"""

Colour = tuple[int, int, int]

LEFT: Colour = (31, 130, 200)
RIGHT: Colour = (222, 100, 10)
MIDDLE: Colour = (150, 150, 150)
DARK: Colour = (28, 30, 34)  # ground of skeletons
# Of what is neither side: Okabe and Ito's other colours.
GREEN: Colour = (0, 158, 115)
PURPLE: Colour = (204, 121, 167)
_GREY = 105  # that faint colours fade to


def faint(colour: Colour, share: float) -> Colour:
    """The colour with that share of its difference from a grey, which shows on dark and on white ground."""
    red, green, blue = (round(_GREY + share * (part - _GREY)) for part in colour)
    return red, green, blue


def side_colour(*joints: str) -> Colour:
    """Of a joint, or of a bone by its ends: its side's; the middle's when it has no side or crosses over."""
    sides = {joint[:2] for joint in joints} & {"l_", "r_"}
    return MIDDLE if len(sides) != 1 else LEFT if sides == {"l_"} else RIGHT


def as_hex(colour: Colour) -> str:
    """For HTML."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
