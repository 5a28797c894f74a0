"""Sealed challenges: made and sealed, answered by the public command, opened and scored."""
