"""The effects, one file each: its law, its parameters, where a fit starts, and what is known of it."""
