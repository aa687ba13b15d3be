"""The command line: a thin skin, one module per command."""
