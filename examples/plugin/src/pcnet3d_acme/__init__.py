"""An adapter, a stage, a writer and a lifter for pcnet3d, to be copied and changed."""
