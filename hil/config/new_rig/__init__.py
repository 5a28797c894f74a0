"""A new rig file, from a few answers: ``questions`` (what is asked), ``answers`` (how), ``text`` (the file)."""
