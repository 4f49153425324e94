"""Which way is up: one answer from every source that knows something, with its error.

`person` has a person's frames, `sampling` asks a rectifier about as many of them as inform, and `evidence` what any
source says about up: `votes` pools the frames', `floor` reads it off feet that stand, `images` reads it off an
image's straight lines (`lines` finds those, and fits the directions of a built world to them), `view` does it for a
video. `fusion` fuses all or decides between them, `moving` does it for each frame of a camera that moves. `levelling`
makes a take of it, and says what a lift may rest on, `people` of several people, `live` while the camera runs.
"""
