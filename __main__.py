"""`python -m pcnet3d`: the program, where the folder of programs is not on the path."""

from .pipeline.cli import program

if __name__ == "__main__":
    program()
