"""Training material made where the network trains, in torch: people, cameras, a detector and what the lifter sees.

The deterministic functions equal those of `bodies`, `cameras`, `keypoint_noise` and `lifter/features`, which the test
bed and the run time use (a test compares them); the random ones draw from the same ranges and from more. Needs torch.
"""
