"""Which variables of an FMU are torque, load, output and start: ``--map torque=T_M1,T_M2`` and the like."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from estimator.signals.record import OutputKind
from hil.errors import UsageError

KEYS = ("torque", "output", "load", "start", "load_speed")
SINGLE = ("output", "load", "load_speed")


@dataclass(frozen=True, slots=True)
class Names:
    """Names of an FMU's variables."""

    torque: tuple[str, ...] = ("T_M1", "T_M2")  # inputs, in the order of the recording's torques
    output: str = "speed_measured"  # what is held against the measured output
    load: str = "T_load"  # input or parameter that takes a constant load torque, to be estimated
    load_speed: str = "speed_load"  # output that is the speed of the load, for laws at it; "" for none
    # parameters of the initial state: speed, twist, speed of the load; () for none
    start: tuple[str, ...] = ("start.speed", "start.twist", "start.load_speed")


OF_A_POSITION = Names(output="angle_motor", start=("start.angle", *Names().start))
"""What a recorded position is held against."""


def names(given: Sequence[str], known: Collection[str], kind: OutputKind = OutputKind.SPEED) -> Names:
    """Return the names that ``--map`` gives, the others as ``hil export fmu`` writes them."""
    mapped = _mapped(given)
    standard = OF_A_POSITION if kind is OutputKind.POSITION else Names()

    def several(key: str, usual: tuple[str, ...]) -> tuple[str, ...]:
        return mapped.get(key, tuple(name for name in usual if name in known))

    found = Names(
        torque=several("torque", standard.torque),
        output=(*mapped.get("output", ()), standard.output)[0],
        load=(*several("load", (standard.load,)), "")[0],
        load_speed=(*several("load_speed", (standard.load_speed,)), "")[0],
        start=several("start", standard.start),
    )
    used = (found.torque or ("",), (found.output,), (found.load,), found.start, (found.load_speed,))
    for key, each in zip(KEYS, used, strict=True):
        for name in each if any(each) or key not in ("load", "load_speed") else ():
            if name not in known:
                raise UsageError(
                    f"--map {key}={name or '...'}: expected a variable of the FMU, got {name or 'none'!r}. It has: "
                    f"{some(known)}"
                )
    return found


def _mapped(given: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the names that were given for each key."""
    entries = [text.partition("=") for text in given]
    for text, (key, sign, _) in zip(given, entries, strict=True):
        if key not in KEYS or not sign:
            raise UsageError(f"--map {text}: expected KEY=NAME, KEY one of {', '.join(KEYS)}")
        if [each for each, _, _ in entries].count(key) > 1:
            raise UsageError(f"--map {text}: expected {key} once, got it twice. Give its names in one: {key}=A,B")
    mapped = {key: tuple(name.strip() for name in value.split(",") if name.strip()) for key, _, value in entries}
    for key, named in mapped.items():
        if len({*named}) < len(named) or (key in SINGLE and len(named) > 1):
            most = "one name" if key in SINGLE else "each name once"
            raise UsageError(f"--map {key}={','.join(named)}: expected {most}")
    return mapped


def some(known: Collection[str]) -> str:
    """Return the first names of some, and how many more there are."""
    shown = sorted(known)
    return ", ".join(shown[:20]) + (f" and {len(shown) - 20} more" if len(shown) > 20 else "")
