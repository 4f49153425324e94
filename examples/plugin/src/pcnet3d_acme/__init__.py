"""An adapter and a stage for pcnet3d, to be copied and changed."""
