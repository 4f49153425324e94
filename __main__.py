"""`python -m pcnet3d`: the program, where the folder of programs is not on the path."""

from .pipeline.cli import main

if __name__ == "__main__":
    main()
