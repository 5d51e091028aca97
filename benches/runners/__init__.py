"""One module per tool: how it is told to run chains of three trivial tasks."""
