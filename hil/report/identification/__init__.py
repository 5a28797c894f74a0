"""What was identified, as one self-contained page: ``hil identify`` and ``hil paper``."""
