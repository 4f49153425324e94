"""The built-in example, and short scripts that show how to use the parts."""
