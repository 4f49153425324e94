"""Training material made where the network trains, in torch: people, cameras, a detector and what the lifter sees.

What draws nothing is shared with the test bed (`bodies`, `cameras`, `keypoint_noise`, `views`); `features` equal those
of the run time (a test compares them). What is random draws from the same ranges and from more. Needs torch.
"""
