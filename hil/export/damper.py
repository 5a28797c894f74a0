"""Active damping as Structured Text and C: the arithmetic of ``hil.rig.damper.Damping``, in its order."""

from __future__ import annotations

from string import Template
from typing import Final

from hil.config.damper_file import DamperFile, DesignedFor
from hil.errors import UsageError
from hil.rig.damper import BIAS, most_at_limit
from hil.version import __version__

_ST: Final = Template(
    """\
(* FB_HilDamper: active damping, torque = -b(z) / a(z) speed. Written by hil $version, IEC 61131-3 Structured Text.

   Call it once per period of $period s, with the frequency of FB_HilEstimator. Its torque is added to the torque
   reference, under the drive's own limits, and has to act $dead_time s after the speed was sampled. It goes off, until
   enable has been FALSE, where the resonance leaves the region or its torque stays at MOST. *)
FUNCTION_BLOCK FB_HilDamper
VAR_INPUT
    enable    : BOOL;          (* FALSE: no torque, and it starts anew; also where the speed was not read *)
    speed     : LREAL;         (* motor speed [rad/s] *)
    frequency : LREAL;         (* of the resonance [Hz]; 0 while the estimator's status is not 1 *)
END_VAR
VAR_OUTPUT
    torque : LREAL;            (* of both inverters together [Nm] *)
    isOff  : BOOL;             (* it went off by itself *)
END_VAR
VAR
    isRunning : BOOL;
    atLimit   : DINT;          (* cycles in a row *)
    first     : LREAL;
    second    : LREAL;
    wanted    : LREAL;
END_VAR
VAR CONSTANT
    B0 : LREAL := $b0;
    B1 : LREAL := $b1;
    B2 : LREAL := $b2;
    A1 : LREAL := $a1;
    A2 : LREAL := $a2;
    MOST : LREAL := $limit;    (* [Nm] *)
    LOW  : LREAL := $low;    (* [Hz] *)
    HIGH : LREAL := $high;
END_VAR

IF NOT enable THEN
    isOff := FALSE;
    atLimit := 0;
ELSIF (atLimit > $cycles) OR ((frequency > 0.0) AND ((frequency < LOW) OR (frequency > HIGH))) THEN
    isOff := TRUE;
END_IF;
IF enable AND NOT isOff AND (ABS(speed) < 1.0E+30) THEN
    IF NOT isRunning THEN
        first := (B1 + B2) * speed;
        second := B2 * speed;
        isRunning := TRUE;
    END_IF;
    wanted := B0 * speed + first;
    torque := wanted;
    IF torque > MOST THEN
        torque := MOST;
    ELSIF torque < -MOST THEN
        torque := -MOST;
    END_IF;
    IF torque = wanted THEN
        atLimit := 0;
    ELSE
        atLimit := atLimit + 1;
    END_IF;
    first := B1 * speed - A1 * torque + second;
    second := B2 * speed - A2 * torque;
    torque := -torque;
ELSE
    torque := 0.0;
    isRunning := FALSE;
END_IF;
END_FUNCTION_BLOCK
"""
)

_C: Final = Template(
    """\
/* Active damping, torque = -b(z) / a(z) speed. Written by hil $version.

   Start with a structure of zeros and call it once per period of $period s. Its torque is added to the torque
   reference, under the drive's own limits, and has to act $dead_time s after the speed was sampled. It goes off, until
   enable has been 0, where the resonance leaves the region or its torque stays at the limit. Compile without
   contraction of products and sums (-ffp-contract=off) to have the host's torque to the bit. */
typedef struct {
    int is_off, is_running, at_limit;
    double first, second;
} hil_damper;

/* Return the torque of both inverters together [Nm] for a motor speed [rad/s] and the frequency of the resonance [Hz],
   0 where it is not known; enable is 0 also where the speed was not read. */
double hil_damper_torque(hil_damper *damper, int enable, double speed, double frequency)
{
    const double b0 = $b0, b1 = $b1, b2 = $b2;
    const double a1 = $a1, a2 = $a2, limit = $limit;
    double wanted, torque;

    if (!enable)
        damper->is_off = damper->at_limit = 0;
    else if (damper->at_limit > $cycles || (frequency > 0.0 && (frequency < $low || frequency > $high)))
        damper->is_off = 1;
    if (!enable || damper->is_off || !(speed > -1e30 && speed < 1e30)) {
        damper->is_running = 0;
        return 0.0;
    }
    if (!damper->is_running) {
        damper->first = (b1 + b2) * speed;
        damper->second = b2 * speed;
        damper->is_running = 1;
    }
    wanted = b0 * speed + damper->first;
    torque = wanted > limit ? limit : wanted < -limit ? -limit : wanted;
    damper->at_limit = torque == wanted ? 0 : damper->at_limit + 1;
    damper->first = b1 * speed - a1 * torque + damper->second;
    damper->second = b2 * speed - a2 * torque;
    return -torque;
}
"""
)


def damper_text(file: DamperFile, rig: DesignedFor, suffix: str) -> str:
    """Return the text for a file's suffix."""
    template = {".st": _ST, ".c": _C}.get(suffix)
    if template is None:
        raise UsageError(f"--out: expected a file that ends in .st or .c, got {suffix!r}")
    (b0, b1, b2), (_, a1, a2), (low, high) = file.filter.b, file.filter.a, file.region_hz
    numbers = {"b0": b0, "b1": b1, "b2": b2, "a1": a1, "a2": a2, "limit": rig.limit_nm}
    numbers |= {"low": low / (1.0 + BIAS), "high": high / (1.0 - BIAS)}  # the estimate is off by a share of itself
    return template.substitute(
        {name: f"{value:.17E}" for name, value in numbers.items()},
        version=__version__,
        period=f"{file.period_s:g}",
        dead_time=f"{file.dead_time_s:g}",
        cycles=most_at_limit(file),
    )
