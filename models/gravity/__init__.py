"""Which way is up: one answer from every source that knows something, with its error.

`evidence` is what any source says about up, and what all say together: `votes` pools a person's frames, of which
`sampling` asks a rectifier about as many as inform, `floor` reads it off feet that stand, `images` reads it off an
image's straight lines (`lines` finds those, and fits the directions of a built world to them), `view` does it for a
video. `moving` does it for each frame of a camera that moves. `levelling` makes a take of it, or several people's, and
says what a lift may rest on; `live` does it while the camera runs.
"""
