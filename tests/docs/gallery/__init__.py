"""The failures of docs/gallery.md: each provoked on the simulated rig or by a file, reported by the tool itself."""
