"""An adapter, a stage and a writer for pcnet3d, to be copied and changed."""
