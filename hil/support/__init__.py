"""What helps whoever helps a user: the log of every command, and a report that gives no secret away.

What may come in: what a command was called with, and what the libraries log.
"""
