"""One module per tool, with the files and commands for chains of three trivial tasks."""
