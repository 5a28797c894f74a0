"""The files an engineer writes by hand, and everything that can be wrong in them.

What lives here: rig file, model file, their schemas and templates. What may come in: text and EDS files; of other rooms
`hil.recording` alone, for the table of signals. Nothing is opened but files.
"""
