"""The resonance followed through a drive: how sure it is, when it changed, and the alarm that says so."""
