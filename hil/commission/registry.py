"""The steps in their order: a new one is one file and one line here."""

from __future__ import annotations

from hil.commission.steps import (
    devices,
    diagnosis,
    experiments,
    friction,
    identification,
    limits,
    noise,
    prbs,
    scales,
    signs,
    validation,
)

STEPS = (
    devices.STEP,
    limits.STEP,
    noise.STEP,
    signs.STEP,
    scales.STEP,
    friction.STEP,
    prbs.STEP,
    experiments.STEP,
    identification.STEP,
    validation.STEP,
    diagnosis.STEP,
)

NAMES = tuple(step.name for step in STEPS)
