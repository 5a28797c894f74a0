"""What helps whoever helps a user: the log of every command, and a report that gives no secret away."""
