"""What a drive is asked for, which of its objects can give it, and what is done where none can."""
