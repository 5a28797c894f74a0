"""Commissioning: the job from the first look for devices to model file and report, step by step, and resumable."""
