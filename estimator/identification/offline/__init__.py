"""Models fitted to a whole recording, and what says whether to believe them."""
