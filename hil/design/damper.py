"""What the design of a damper is given, and what it says: lines that are possible, dead time, limits, pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtri

from drivers.inverter.dead_time import MOST_CYCLES
from estimator.damper import MOST_SENSITIVE, PARAMETERS, Damper, Demand, Loop, Region, Timing, points
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel, Motion, Structure
from estimator.physics.table_signals import slopes_of
from estimator.physics.tables import table_of
from estimator.signals.correlation import reading_lag
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import FloatArray
from hil.config.damper_file import SCHEMA, DamperFile, DesignedFor
from hil.config.model_file import read_model
from hil.config.rig_file import read_rig
from hil.errors import FileProblem, ModelFileError, UsageError
from hil.figures.drawn import WIDTH_IN, drawing, require_matplotlib
from hil.figures.local_model import decibels, degrees
from hil.figures.palette import BLACK, PALE, VERMILION
from hil.recording.formats import read_table
from hil.report.diagnosis_json import SCHEMA as DIAGNOSIS
from hil.report.identification_input import PhysicalValue, json_object, physical_value, physical_values, table

CHECK = "hil.check/1"  # schema of what `hil check` prints and keeps
DRIVES = 2
USUAL_PERIOD_S = 0.01
Z95 = 1.96

LINEAR = ("actuator_lag", "transport_delay", "torque_bias", "torque_ripple", "speed_quantisation")
"""Effects between torque and speed that the design takes into account, or that leave the loop as it is."""

LINEARISED = {
    "table_shaft_twist": "k",
    "table_shaft_rate": "c",
    "table_motor_speed": "b_M",
    "table_load_speed": "b_L",
}
"""Curves whose slope is more of a parameter: from the least to the largest, each is a line that is possible."""

BETWEEN = (Element.TORQUE_PATH, Element.SHAFT, Element.SPEED_SENSOR)

SHOWN_S = 1.0


@dataclass(frozen=True, slots=True)
class Order:
    """What is asked, at the rig's period; without a rig there is no limit of the torque."""

    period_s: float  # of the loop [s]
    demand: Demand  # damping that is asked for, and the torque it may take
    rig: DesignedFor | None = None  # None: it is designed for no rig, and drives none


def asked(path: Path | None, target: float, share: float) -> Order:
    """Return what is asked of a damper: no more torque than the share, nor than the guard leaves."""
    if path is None:
        return Order(USUAL_PERIOD_S, Demand(target, math.inf, np.empty(0)))
    rig = read_rig(path)
    limits, prbs = rig.torque_limits, rig.prbs
    room_nm = limits.prbs_limit_nm / max(prbs.part_m1, 1.0 - prbs.part_m1) - prbs.amplitude_nm
    if room_nm <= 0.0:
        raise UsageError(
            f"{path}: the PRBS takes all of guard.prbs_limit_nm, expected room for the damper. Lower prbs.amplitude_nm."
        )
    limit_nm = min(share * (limits.torque_limit_m1_nm + limits.torque_limit_m2_nm), room_nm)
    one_turn = (2**prbs.cells - 1) * prbs.clock_divider
    excitation = prbs_nm(one_turn, prbs.amplitude_nm, prbs.cells, prbs.clock_divider, prbs.seed)
    return Order(rig.period_s, Demand(target, limit_nm, excitation), DesignedFor.of(rig, limit_nm))


def region_of(path: Path, estimate: Path | None) -> tuple[Region, DrivelineModel]:
    """Return the lines that a model file and an estimate leave possible."""
    model = read_model(path).model
    if model.structure is not Structure.TWO_MASS or model.motion is not Motion.ROTATION:
        got = f"{model.motion.value}, {model.structure.value}"
        raise ModelFileError(path, f"structure | expected a rotating two_mass line | got {got}")
    for name in model.effects:
        if name not in LINEAR and name not in LINEARISED and EFFECTS[name].element in BETWEEN:
            raise ModelFileError(path, f"effects.{name} | expected a line that is linear from torque to speed | got it")
    value = {name: parameter.value for name, parameter in model.parameters.items()}
    least, most = {n: p.low for n, p in model.parameters.items()}, {n: p.high for n, p in model.parameters.items()}
    if estimate is not None:
        known = _known(estimate)
        widened = math.sqrt(chdtri(len(known), 0.05)) / Z95  # the box around the joint 95 % ellipsoid
        value |= {name: one.value for name, one in known.items()}
        least |= {name: one.value - widened * one.half_width for name, one in known.items()}
        most |= {name: one.value + widened * one.half_width for name, one in known.items()}
    for name in [each for each in LINEARISED if each in model.effects]:
        slopes, of = slopes_of(table_of(name, model.effects[name])), LINEARISED[name]
        value[of] += 0.5 * (min(slopes) + max(slopes))
        least[of], most[of] = least[of] + min(slopes), most[of] + max(slopes)
    for name in PARAMETERS[:3]:
        if least[name] <= 0.0:
            raise UsageError(f"{estimate or path}: {name} is known too little, its region reaches {least[name]:.3g}.")
    at_least, at_most = {n: max(least[n], 0.0) for n in PARAMETERS}, {n: most[n] for n in PARAMETERS}
    return Region({n: value[n] for n in PARAMETERS}, at_least, at_most), model


def _known(path: Path) -> dict[str, PhysicalValue]:
    """Read what a diagnosis or an identification determined, with its 95 % intervals."""
    content = json_object(path)
    if content.get("schema") == DIAGNOSIS:
        entries = table(content, "parameters")
        read = {name: physical_value({"determined": True, **table(entries, name)}, "") for name in entries}
        found = {name: value for name, value in read.items() if name in PARAMETERS and value is not None}
    else:
        found = physical_values(path)
    if not found:
        raise FileProblem(path, f"parameters | expected intervals of some of {', '.join(PARAMETERS)} | got none")
    return found


def timing_of(
    model: DrivelineModel,
    period_s: float,
    recording: Path | None,
    tell: Callable[[str], None],
    check: Path | None = None,
) -> Timing:
    """Return when a torque acts: what was measured and a cycle, and the model's own delay and lag.

    The cycle: the speed of one SYNC makes the torque that the next one puts into effect. Measured: what a stop proof
    has counted of the drives, and how late the torque of a recording follows; the greater of both where both are given.
    """
    effects = {name: {key: one.value for key, one in values.items()} for name, values in model.effects.items()}
    late_s = effects.get("transport_delay", {}).get("delay_s", 0.0)
    lag_s = effects.get("actuator_lag", {}).get("time_constant_s", 0.0)
    measured = {} if recording is None else {recording: _cycles_late(recording, period_s)}
    measured |= {} if check is None else {check: _cycles_counted(check)}
    cycles = max(measured.values(), default=0)
    said = "; ".join(f"{path}: {count} cycles and one" for path, count in measured.items())
    tell(f"dead time of bus and inverters: {said or 'taken for one period: give --check or --recording'}")
    return Timing(period_s, (1 + cycles) * period_s + late_s, lag_s)


def _cycles_counted(path: Path) -> int:
    """Return the most cycles that a stop proof has counted from a command to the answer of a drive."""
    content = json_object(path)
    devices = content.get("devices") if content.get("schema") == CHECK else None
    given = [each.get("dead_cycles") for each in devices or () if isinstance(each, dict)]
    counted = [int(each) for each in given if type(each) is int and 0 <= each <= MOST_CYCLES]
    if len(counted) < DRIVES:
        expected = f"dead_cycles of both drives, as hil check --prove-stop --out {path.name} counts them"
        raise FileProblem(path, f"devices | expected {expected} | got those of {len(counted)}")
    return max(counted)


def _cycles_late(path: Path, period_s: float) -> int:
    """Return by how many cycles the torque of a recording follows its reference."""
    columns = read_table(path).columns
    names = ("time_s", "torque_ref_nm", "torque_m1_nm", "torque_m2_nm")
    if missing := [name for name in names if name not in columns]:
        raise UsageError(f"{path}: expected {', '.join(missing)}, to measure the dead time by, got none")
    time_s, reference, m1, m2 = (np.nan_to_num(columns[name]) for name in names)
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else math.nan
    if not abs(step_s - period_s) < 0.01 * period_s or np.ptp(reference) == 0.0:
        raise UsageError(
            f"{path}: expected a torque that changes, a row every {period_s:g} s, to measure the dead time by, got a "
            f"row every {step_s:g} s and a change of {np.ptp(reference):g} Nm. Give a run of this rig with its PRBS."
        )
    return reading_lag(m1 + m2, reference)


def file_of(found: Damper, region: Region, order: Order, model: str) -> DamperFile:
    """Return the design as its file."""
    return DamperFile.model_validate(
        {
            "schema": SCHEMA,
            "model": model,
            "period_s": found.timing.period_s,
            "dead_time_s": found.timing.dead_time_s,
            "lag_s": found.timing.lag_s,
            "region_hz": list(found.region_hz),
            "least_damping": found.least_damping,
            "sensitivity": found.sensitivity,
            "torque_nm": found.torque_nm,
            "line": found.line,
            "intervals": {name: [region.low[name], region.high[name]] for name in PARAMETERS},
            "filter": {"b": found.filter.b.tolist(), "a": found.filter.a.tolist()},
            "rig": order.rig,
        }
    )


def design_document(file: DamperFile, found: Damper) -> dict[str, Any]:
    """Return the design as JSON: its file, and resonance and damping before and after."""
    before, after = ({"frequency_hz": mode.frequency_hz, "damping": mode.damping} for mode in file.nominal[:2])
    content = file.model_dump(by_alias=True) | {"schema": "hil.design_damper/1", "lines": found.n_lines}
    return content | {"before": before, "after": after}


def design_lines(file: DamperFile, found: Damper) -> Iterator[str]:
    """Say what was designed."""
    (before, after, _), (low, high) = file.nominal, file.region_hz
    yield (
        f"resonance {before.frequency_hz:.2f} Hz, damping {before.damping:.3f}; with the damper "
        f"{after.frequency_hz:.2f} Hz, {after.damping:.3f}"
    )
    yield (
        f"  over {found.n_lines} lines, resonance {low:.2f} to {high:.2f} Hz: damping at least "
        f"{file.least_damping:.3f}, sensitivity at most {file.sensitivity:.2f}"
    )
    yield f"  filter of order 2, period {file.period_s:g} s, dead time {file.dead_time_s * 1e3:.1f} ms"
    if file.rig is None:
        yield "  no rig, so no torque limit: it can be looked at, and not driven"
    else:
        yield f"  torque under the rig's PRBS up to {file.torque_nm:.0f} Nm, limited to {file.rig.limit_nm:.0f} Nm"


def draw(found: Damper, region: Region, path: Path) -> None:
    """Draw Bode, Nyquist, step and disturbance of the nominal line before and after, and of the corners after."""
    require_matplotlib()
    loop, z = Loop(list(region.corners()), found.timing), points(found.timing.period_s, 600)
    f = np.angle(z) / (2.0 * np.pi * found.timing.period_s)
    G, K = loop.response(z), found.filter.response(z)
    L, after = K * G, G / (1.0 + K * G)
    corner, own = {"color": PALE, "linewidth": 0.5}, {"color": VERMILION}
    with drawing():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(WIDTH_IN, 6.6))
        (bode, nyquist), (phase, sensitivity), (step, pulse) = figure.subplots(3, 2)
        for panel, of, label in ((bode, decibels, "torque to speed [dB]"), (phase, degrees, "phase [deg]")):
            for line in after[1:]:
                panel.semilogx(f, of(line), **corner)
            panel.semilogx(f, of(G[0]), "--", color=BLACK, label="before")
            panel.semilogx(f, of(after[0]), label="after", **own)
            panel.set(xlabel="frequency [Hz]", ylabel=label)
        bode.legend()
        nyquist.plot(L[1:].real.T, L[1:].imag.T, **corner)
        nyquist.plot(L[0].real, L[0].imag, **own)
        circle = -1.0 + np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 100)) / MOST_SENSITIVE
        nyquist.plot(circle.real, circle.imag, ":", color=BLACK)
        nyquist.plot(-1.0, 0.0, "+", color=BLACK)
        nyquist.set_aspect("equal", "datalim")
        nyquist.set(xlabel="Re K G", ylabel="Im K G", title=f"Nyquist; dotted: |S| = {MOST_SENSITIVE:g}")
        sensitivity.semilogx(f, 1.0 / np.abs(1.0 + L[1:]).T, **corner)
        sensitivity.semilogx(f, 1.0 / np.abs(1.0 + L[0]), **own)
        sensitivity.axhline(MOST_SENSITIVE, color=BLACK, linestyle=":")
        sensitivity.set(xlabel="frequency [Hz]", ylabel="sensitivity |S|")
        for panel, lasts_s, title in (
            (step, SHOWN_S, "step of 100 Nm"),
            (pulse, 0.05, "disturbance, 100 Nm for 50 ms"),
        ):
            panel.plot(*_answer(loop, None, lasts_s), "--", color=BLACK)
            panel.plot(*_answer(loop, found, lasts_s), **own)
            panel.set(xlabel="time [s]", ylabel="speed [rad/s]", title=title)
        figure.savefig(path, dpi=150)


def _answer(loop: Loop, found: Damper | None, lasts_s: float) -> tuple[FloatArray, FloatArray]:
    """Return time and the nominal line's speed under 100 Nm."""
    A = loop.A[0] if found is None else loop.closed(found.filter)[0]
    time_s = np.arange(round(SHOWN_S / loop.period_s), dtype=np.float64) * loop.period_s
    x, speed = np.zeros(A.shape[0]), np.zeros_like(time_s)
    for k, t in enumerate(time_s.tolist()):
        speed[k] = x[0]
        x = A @ x
        if t < lasts_s:
            x[: loop.B.shape[1]] += 100.0 * loop.B[0]
    return time_s, speed
