"""What is in a recording, and what its channels could be: ``hil look``."""
