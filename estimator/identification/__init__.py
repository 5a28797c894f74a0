"""Identification: linear models of what a recording shows, recursive and off line, and their modes."""
