"""A diagnosis with every field filled, made by hand: the report is judged, not the diagnosis."""

import base64
import gzip
import re

import numpy as np
import pytest

from estimator.diagnosis.result import (
    BandTest,
    Counted,
    Course,
    Diagnosis,
    Discrepancy,
    Equivalent,
    ErrorSpectrum,
    Estimated,
    Evidence,
    Fit,
    FoundEffect,
    LawPicture,
    Mismatch,
    Profile,
    Region,
    RejectedEffect,
    Response,
    Retuned,
    Trace,
    UnnamedTable,
    UntestableEffect,
    Verdict,
)
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel, Parameter, Structure

NAN = float("nan")

MISMATCH = Mismatch(
    detected=True,
    element=Element.SHAFT,
    time_s={"run_1": ((1.5, 6.2), (17.0, 22.1))},
    band_hz=(6.5, 11.0),
    region=Region("shaft torque", -20.0, 20.0, "Nm"),
    p_value=0.0,
)

BACKLASH = FoundEffect(
    name="backlash",
    element=Element.SHAFT,
    statement="the shaft has a backlash of 0.021 rad in total",
    parameters={
        "gap_rad": Estimated(0.0210000000000001, (0.020, 0.022), "rad"),
        "contact_rad": Estimated(0.0012, (NAN, NAN), "rad"),
    },
    time_s={"run_1": ((1.5, 6.2),)},
    indistinguishable_from=("shaft_hysteresis",),
    evidence=Evidence(5321.0, 0.41, 0.052, 1e-12),
    share=0.94,
    probability=0.95,
    necessity=0.97,
    least_necessity=0.9,
    counted=Counted(18, 18),
)

PARAMETERS = {
    "J_M": Retuned(1.6, 1.52, (1.51, 1.53), "kg m^2"),
    "J_L": Retuned(95.0, 99.7, (99.0, 100.4), "kg m^2"),
    "k": Retuned(4200.0, 4310.0, (4290.0, 4330.0), "Nm/rad"),
    "c": Retuned(9.0, 8.4, (8.1, 8.7), "Nm s/rad"),
    "b_M": Retuned(0.0, 0.31, (NAN, NAN), "Nm s/rad"),
    "b_L": Retuned(0.9, 0.92, (0.8, float("inf")), "Nm s/rad"),
}


def grade() -> FoundEffect:
    knots = np.linspace(0, 30, 16)
    return FoundEffect(
        name="road_grade",
        element=Element.LOAD,
        statement="the load torque wanders by 12 Nm (rms) over time, as a road's grade does",
        parameters={"grade_rms_nm": Estimated(12.0, (11.0, 13.0), "Nm")},
        time_s={},
        indistinguishable_from=(),
        evidence=Evidence(120.5, 0.06, 0.052, 2e-7),
        profiles={"run_1": Profile(knots, 10 * np.sin(knots), 10 * np.sin(knots) - 2, 10 * np.sin(knots) + 2, "Nm")},
    )


def trace(name: str, holdout: bool, seed: int, n: int = 3000) -> Trace:
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(n)
    smooth = 80 + 40 * np.sin(0.4 * t + seed)
    wobble = 2.0 * np.sin(2 * np.pi * 8.2 * t) * (np.sin(0.4 * t) > 0.5)
    measured = smooth + wobble + rng.normal(scale=0.05, size=n)
    okay = np.ones(n, dtype=np.bool_)
    okay[400:460] = False
    return Trace(
        name=name,
        time_s=t,
        torque_nm=np.column_stack([150 * np.sin(0.4 * t) + 30 * np.sign(np.sin(9 * t)), 150 * np.sin(0.4 * t)]),
        measured=measured,
        okay=okay,
        nominal=smooth + 1.5,
        retuned=smooth + 0.2 * np.sin(0.1 * t),
        augmented=smooth + wobble,
        holdout=holdout,
    )


def unnamed_table() -> UnnamedTable:
    """Return a law without a name: a dead band over the twist, beyond which one recording never went."""
    values = (40.0, 20.0, 0.0, -20.0, -40.0)
    return UnnamedTable(
        place="shaft_twist",
        element=Element.SHAFT,
        over="the twist of the shaft",
        unit="rad",
        torque_unit="Nm",
        knots=(-0.04, -0.02, 0.0, 0.02, 0.04),
        values=values,
        ci95=tuple((value - 2.0, value + 2.0) for value in values),
        slope=2000.0,
        reached=(-0.03, 0.025),
        rms_before=0.41,
        rms_after=0.12,
        looks_like="a dead band of 0.02 rad",
        formula="torque = 1e+03 x",
        rival="the torque that is read",
        not_carried=("run_2",),
    )


def discrepancy() -> Discrepancy:
    t, f = np.arange(0, 30, 0.01), np.linspace(0.4, 50, 128)
    x = np.linspace(-400.0, 600.0, 20)
    course = Course(t, np.sin(t), np.sin(t) - 0.2, np.sin(t) + 0.2)
    places = (("motor", "Nm", 3101.0), ("shaft", "Nm", 3285.0), ("load", "Nm", -118.0), ("sensor", "rad/s", -4641.0))
    size = 1 / f
    measured = size * np.exp(-1j * f / 30)
    response = Response(f, measured, 0.05 * size, np.full(f.size, 0.9), 0.8 * measured, measured, 1e-20, 0.6)
    law = -30 * np.tanh(x / 50)
    return Discrepancy(
        element=Element.SHAFT,
        equivalents=tuple(
            Equivalent(place, unit, {"run_1": course, "run_2": course}, likelihood, place == "shaft")
            for place, unit, likelihood in places
        ),
        spectrum=ErrorSpectrum(
            f, 0.1 / f, 0.01 / f, 0.007, (BandTest(6.25, 12.5, 218.2, 0.0), BandTest(12.5, 50, 1.1, 0.4))
        ),
        responses={"run_1": response, "run_2": response},
        pictures=(
            LawPicture(
                "backlash", Element.SHAFT, "shaft torque k·twist", "Nm", "Nm", x, law + 1, law - 2, law + 4, law, 0.92
            ),
        ),
    )


@pytest.fixture
def diagnosis() -> Diagnosis:
    return Diagnosis(
        verdict=Verdict.EXPLAINED,
        statement="The shaft has a backlash of 0.021 rad <in total>: reversals cross it & ring at 8.2 Hz.",
        mismatch=MISMATCH,
        effects=(BACKLASH, grade()),
        rejected=(
            RejectedEffect("stiffness_nonlinearity", "explains 48 % of what backlash explains", -2210.0),
            RejectedEffect("stribeck_friction", "its interval holds the null", -17.2),
        ),
        untestable=(
            UntestableEffect(
                "coulomb_friction_motor",
                "the speed never changes sign: not separable from the constant load",
                "reversal",
            ),
        ),
        fit=Fit("rad/s", 1.72, 1.41, 0.0521, 1.38, 0.0533, 0.0502),
        parameters=PARAMETERS,
        load_torque={"run_1": Estimated(58.3, (57.9, 58.7), "Nm")},
        timing_s={"total": 4.2},
        augmented=DrivelineModel(
            Structure.TWO_MASS, {name: Parameter(1.0, 0.2) for name in Structure.TWO_MASS.parameter_names}
        ),
        traces=(trace("run_1", False, 1), trace("run_2", False, 2), trace("unseen", True, 3)),
        warnings=("run_2 has 60 samples missing",),
        discrepancy=discrepancy(),
    )


def figures(page: str) -> str:
    """Return what the figures of a page hold, as JSON; in the page it is packed."""
    packed = re.findall(r'<script type="text/plain" id="[^"]*-data">([^<]*)</script>', page)
    return "\n".join(gzip.decompress(base64.b64decode(each)).decode() for each in packed)
