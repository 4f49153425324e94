"""Training material made where the network trains, in torch: people, cameras, a detector and what the lifter sees.

What draws nothing is shared with the test bed (`bodies`, `cameras`, `keypoint_noise`); `features` equal those of the
run time (a test compares them). Views of single frames are numpy's. What is random draws from the same ranges and from
more. Needs torch.
"""
