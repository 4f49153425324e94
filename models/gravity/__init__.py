"""Which way is up: one answer from every source that knows something, with its error.

`evidence` is what any source says about up, and what all say together: `votes` asks a rectifier about a person's
frames, as many as inform, and pools them, and reads it off feet that stand, `images` off an image's straight lines, to
which it fits the directions of a built world, `view` does it for a video. `levelling` makes a take of it, of a camera
that stands still or moves, or several people's, and says what a lift may rest on; `live` does it while the camera runs.
"""
