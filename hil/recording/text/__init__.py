"""Text recordings: how one is written (recognised, a value that can be printed), and its cells as columns."""
