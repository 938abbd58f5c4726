"""The command line: springscale."""
