"""Which variables of an FMU are torque, load, output and start: ``--map torque=T_M1,T_M2`` and the like."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from estimator.signals.record import OutputKind
from hil.errors import UsageError

KEYS = ("torque", "output", "load", "start")


@dataclass(frozen=True, slots=True)
class Names:
    """Names of an FMU's variables."""

    torque: tuple[str, ...] = ("T_M1", "T_M2")  # inputs, in the order of the recording's torques
    output: str = "speed_measured"  # what is held against the measured output
    load: str = "T_load"  # input or parameter that takes a constant load torque, to be estimated
    start: tuple[str, ...] = ("start.speed", "start.twist", "start.load_speed")


OF_A_POSITION = Names(output="angle_motor", start=("start.angle", *Names().start))
"""What a recorded position is held against."""


def names(given: Sequence[str], known: Collection[str], kind: OutputKind = OutputKind.SPEED) -> Names:
    """Return the names that ``--map`` gives, the others as ``hil export fmu`` writes them."""
    entries = [text.partition("=") for text in given]
    for text, (key, sign, _) in zip(given, entries, strict=True):
        if key not in KEYS or not sign:
            raise UsageError(f"--map {text}: expected KEY=NAME, KEY one of {', '.join(KEYS)}")
        if [each for each, _, _ in entries].count(key) > 1:
            raise UsageError(f"--map {text}: expected {key} once, got it twice. Give its names in one: {key}=A,B")
    mapped = {key: tuple(name.strip() for name in value.split(",") if name.strip()) for key, _, value in entries}
    for key, named in mapped.items():
        if len({*named}) < len(named) or (key in ("output", "load") and len(named) > 1):
            most = "one name" if key in ("output", "load") else "each name once"
            raise UsageError(f"--map {key}={','.join(named)}: expected {most}")
    standard = OF_A_POSITION if kind is OutputKind.POSITION else Names()
    found = replace(
        standard,
        torque=mapped.get("torque", tuple(name for name in standard.torque if name in known)),
        output=(mapped.get("output") or (standard.output,))[0],
        load=(mapped.get("load") or ((standard.load,) if standard.load in known and "load" not in mapped else ("",)))[
            0
        ],
        start=mapped.get("start", tuple(name for name in standard.start if name in known)),
    )
    for key, each in (("torque", found.torque or ("",)), ("output", (found.output,)), ("start", found.start)):
        for name in each:
            if name not in known:
                raise UsageError(
                    f"--map {key}=...: expected a variable of the FMU, got {name or 'none'!r}. It has: {_some(known)}"
                )
    if found.load and found.load not in known:
        raise UsageError(f"--map load={found.load}: expected a variable of the FMU. It has: {_some(known)}")
    return found


def _some(known: Collection[str]) -> str:
    shown = sorted(known)
    return ", ".join(shown[:20]) + (f" and {len(shown) - 20} more" if len(shown) > 20 else "")
