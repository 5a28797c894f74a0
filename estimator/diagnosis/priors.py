"""Priors: what is usual before a recording is seen: effects, sizes of disturbances, mistakes in what was given.

All effects that recordings can show are as probable as each other, given how many there are (`Catalogue.choices`, after
Scott and Berger); ``[priors]`` of a model file gives some of them odds of their own. Where an effect's size may lie
stands with its law in the catalogue (`Effect.scales` and the bounds of its parameters): both follow from the line and
the torque in use. The prior of a mistake that is one row of a table stands in its row (`preconditions/candidates.py`).
A number without a source is a choice, with its reason.
"""

from __future__ import annotations

import math

import numpy as np


class EffectPriors:
    """How common effects are (`inference/moves.py`)."""

    # Laws that most machines have: each search begins from these, too, whatever a look at the bare line promises of
    # them. Dry friction, for one, shows little around a line that has settled on too much damping.
    COMMON = (
        "coulomb_friction_motor",
        "load_imbalance",
        "backlash",
        "actuator_lag",
        "transport_delay",
        "inverter_gain_mismatch",
        "aerodynamic_drag",
    )


class DisturbancePriors:
    """Usual disturbances of torque, load and reading (`inference/disturbances.py`)."""

    # Usual sizes as shares of the torque in use: a reading of a per mille of the rated torque, its drift, and the
    # change of the load in a second (a grade of half a per mille, a breath of wind)
    TORQUE_SHARE, DRIFT_SHARE, WALK_SHARE = 2e-3, 2e-3, 5e-4
    # Usual share of a law's change by which its form is off, and the share beyond which it is another law
    FORM_SHARE, MOST_FORM = 0.1, 0.5
    # Sizes beyond which such a disturbance is physics to be named
    MOST_TORQUE, MOST_DRIFT, MOST_WALK = 2e-2, 2e-2, 5e-3
    # Usual correlation times of a sensor's coloured noise and of a current sensor's drift [s]
    COLOUR_S, DRIFT_S = 0.03, 3.0
    # Between which they are looked for [s], and the sampling periods below which an error is not correlated
    MOST_COLOUR_S, LEAST_DRIFT_S, MOST_DRIFT_S, FEW_PERIODS = 0.3, 0.5, 20.0, 4.0
    FACTOR = 1e3  # either way from its usual size, within which any other one is looked for
    # Standard deviation of the logarithm of a size around the usual one: a factor of 20 is two of them
    PRIOR_SPREAD = 1.5


class MistakePriors:
    """What recordings of a drive usually are, and how often something is wrong (`preconditions/candidates`, `odds`)."""

    GEARS = (3.0, 16.0)  # ratios of the gears behind traction motors
    # Usual periods [s], for times that are counted in rows
    PERIODS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 4e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1)
    UNLIKELY = 0.02  # prior of a period that no driveline is sampled with, and of each that rows may have
    # What inertias in a model file may be in, with the prior of each
    INERTIA_UNITS = (
        (1e-3, "in g m^2, expected kg m^2", 0.02),
        (1e-4, "in kg cm^2, expected kg m^2", 0.04),
        (1e-7, "in g cm^2, expected kg m^2", 0.02),
        (0.25, "a GD^2, which is 4 J", 0.03),
    )
    # Spread of the logarithm of the inertia's ratio: this share of the tolerance, and the error of its fit
    CLOSE = 0.6, 0.1
    # Spread where physics is missing or a payload is on, and how often that is
    PHYSICS, PHYSICS_SHARE = math.log(2.0), 0.08
    # Spread of the two bands' ratio, the share of the cases in which physics spreads it further, and that
    BANDS, BANDS_PHYSICS, BANDS_OTHER = 0.35, 0.1, 1.2
    # Power of the unexplained motion: as of eight independent stretches; and what the shortest model error leaves
    REST, LEAST_REST = 4.0, 0.02
    UNKNOWN_FIT = 1.0 / 6.0  # density of an inertia that nothing tells: from a twentieth to twenty times
    ELSE, TURNED, ALONE = 0.05, 0.15, 0.2  # priors of something else, of a sign turned, and of one recording alone
    # Median, and spread of the logarithm, of the largest torque and speed in a recording of a drive
    USUAL_TORQUE_NM, USUAL_SPEED_RAD_S = (200.0, math.log(8.0)), (80.0, math.log(5.0))
    FAR = 4.0  # spreads beyond which a size is strange, by how much ever: it decides nothing more
    FASTEST_RAD_S, UNREACHED = 2500.0, 1e-3  # 24,000 rpm, and how seldom a recording is of a drive that is faster
    STRANGE = 0.02  # share of the recordings in which something else is, too, or physics that is in no other
    OFFSETS = np.linspace(-2.0, 2.0, 81)  # of the logarithm of the nominal inertia that are tried
