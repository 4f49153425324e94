"""The stage `measures`: ranges, symmetry, repetitions, walking."""
