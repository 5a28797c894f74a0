"""The words a report uses for verdicts, elements and quantities; one place for page and terminal."""

from __future__ import annotations

import math

from estimator.diagnosis.result import Diagnosis, FoundEffect, Mismatch, Verdict
from estimator.physics.catalogue import title_of
from estimator.physics.effect import Element
from estimator.physics.model import Motion, unit
from estimator.signals.record import OutputKind
from hil.report.numbers import listed, shown, shown_p, shown_times

BADGES = {
    Verdict.EXPLAINED: "✓ explained",
    Verdict.PARTLY_EXPLAINED: "✓ partly explained",
    Verdict.UNEXPLAINED: "? mismatch, not explained",
    Verdict.NO_MISMATCH: "= no mismatch",
}

DOUBTFUL = "? the input is in doubt"

ELEMENTS = {each: each.value.replace("_", " ") for each in Element}

PLACES = {"motor": "motor", "shaft": "shaft", "load": "load", "sensor": "reading"}
"""Places where an input may explain a mismatch."""

CHECKS = {
    Element.TORQUE_PATH: "the torque readings against a second source (current, a torque transducer), each "
    "inverter alone, limits and dead times, and the delay between command and shaft.",
    Element.MOTOR: "bearings, brakes and whatever else may drag or turn with the motor; run a reversal and a "
    "coast-down with the shaft disconnected.",
    Element.SHAFT: "couplings, joints and mounts for play, rubber and cracks; repeat the reversal with larger and "
    "smaller torque, and at another temperature.",
    Element.LOAD: "road, wind, brakes, tyres and payload; repeat on a level road in both directions.",
    Element.SPEED_SENSOR: "the resolver against an encoder, its filter and scale, and the reading at standstill "
    "and at constant speed.",
    Element.ACQUISITION: "time stamps, lost and repeated frames, and both clocks.",
}
"""What to look at where nothing in the catalogue explains a mismatch."""

_QUANTITIES = {"rad/s": "speed", "m/s": "speed", "rad": "position", "m": "position", "Nm": "torque", "N": "force"}

_DIMENSIONS = {
    OutputKind.SPEED: "speed",
    OutputKind.POSITION: "angle",
    OutputKind.FORCE: "torque",
    OutputKind.TORQUE: "torque",
    OutputKind.ACCELERATION: "acceleration",
}


def badge(diagnosis: Diagnosis) -> str:
    """Return the mark of a verdict; while the input is in doubt, that; no tick where names are less than sure."""
    said = BADGES[diagnosis.verdict]
    return DOUBTFUL if diagnosis.doubts else said if _are_sure(diagnosis) else f"{said.replace('✓', '≈')}, probably"


def _are_sure(diagnosis: Diagnosis) -> bool:
    return all(effect.counted is None or effect.counted.is_sure for effect in diagnosis.effects)


def quantity(output_unit: str) -> str:
    """Name a measured output by its unit."""
    return _QUANTITIES.get(output_unit, "output")


def output_unit(kind: OutputKind, motion: Motion) -> str:
    """Return the unit of a measured output, for example ``rad/s``."""
    return unit(_DIMENSIONS[kind], motion)


def simulated_column(kind: OutputKind, motion: Motion) -> str:
    """Name the column of a simulated output by its unit, for example ``speed_sim_rad_s`` (CONTRACT)."""
    suffix = output_unit(kind, motion).lower().replace("/", "_")
    return f"{kind.value}_sim_{suffix}"


def torque_axis(motion: Motion) -> str:
    """Name the input and its unit."""
    return f"{'torque' if motion is Motion.ROTATION else 'force'} [{unit('torque', motion)}]"


def headline(diagnosis: Diagnosis) -> str:
    """Say the verdict in one line."""
    if diagnosis.doubts:
        return f"Doubtful before all else: {listed([doubt.about for doubt in diagnosis.doubts])}"
    if not diagnosis.effort.finished:
        return f"Not decided: the search was ended after {diagnosis.effort.limit_s:.3g} s"
    found = [f"{_with_look_alikes(effect)}{_sure(effect)}" for effect in diagnosis.effects]
    missing = f"Missing in the model{'' if _are_sure(diagnosis) else ', probably'}: {listed(found)}"
    if diagnosis.verdict is Verdict.EXPLAINED:
        return missing
    if diagnosis.verdict is Verdict.PARTLY_EXPLAINED:
        return f"{missing}; what is left is more than noise"
    if diagnosis.verdict is Verdict.NO_MISMATCH:
        return "Nothing is missing: the nominal model, re-tuned, explains the recordings"
    if diagnosis.off_nominal:
        return (
            f"No physics need be missing, but the data sheet is off: {listed([v.name for v in diagnosis.off_nominal])}"
        )
    return f"Something is missing, and no effect {diagnosis.effort.fitted} explains it"


def _with_look_alikes(effect: FoundEffect) -> str:
    """Name an effect and what it can't be distinguished from: what was counted is that one of them is there."""
    return " or ".join(title_of(name) for name in (effect.name, *effect.indistinguishable_from))


def _sure(effect: FoundEffect) -> str:
    """Say how often such names were right, in brackets; "" of a fault that was read off the raw data."""
    return "" if effect.counted is None else f" ({effect.counted.words})"


def belief(effect: FoundEffect) -> str:
    """Say how much the simulation needs an effect, and how often such names were right; "" where that was not asked."""
    if effect.counted is None:
        return ""
    of_which = ", it or a look-alike" if effect.indistinguishable_from else ""
    return (
        f"Without it {effect.necessity:.0%} of the error beyond the noise comes back, on samples not used for the fit; "
        f"{effect.share:.0%} of the squared error goes with it. {effect.counted.words}{of_which}. "
    )


def unseen_data(diagnosis: Diagnosis) -> str:
    """Say which samples the errors on unseen data are of; "" where there are none."""
    if not math.isfinite(diagnosis.fit.holdout_retuned):
        return ""
    held_out = [trace.name for trace in diagnosis.traces if trace.holdout]
    if held_out:
        return f"Unseen data: {listed(held_out)}, held out of every fit."
    return (
        "Unseen data: blocks all along the recordings, 30 % of each, of which a further fit of the same model has seen "
        "nothing."
    )


def location_rows(mismatch: Mismatch) -> list[tuple[str, str]]:
    """List where the mismatch is, as far as it is known: what, and its value."""
    rows = []
    if mismatch.element is not None:
        rows.append(("element", ELEMENTS[mismatch.element]))
    if mismatch.band_hz is not None:
        low, high = mismatch.band_hz
        rows.append(("frequency", f"{shown(low)} to {shown(high)} Hz"))
    if mismatch.region is not None:
        region = mismatch.region
        rows.append((f"where {region.signal} is", f"from {shown(region.low)} to {shown(region.high, region.unit)}"))
    rows += [(f"time in {name}", shown_times(spans)) for name, spans in mismatch.time_s.items() if spans]
    rows.append(("p-value against the best set of effects", shown_p(mismatch.p_value)))
    return rows
