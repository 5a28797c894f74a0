"""What a caller of the estimator can do wrong.

::

    EstimatorError
     +-- BadShape     (ValueError)   arrays of the wrong shape, or not finite
     +-- BadModel     (ValueError)   a model whose parameters are missing, unknown or non-physical
     +-- BadSetting   (ValueError)   a setting its algorithm can't work with
     +-- NotExciting                 the data do not determine what was asked
     +-- Implausible  (ValueError)   recordings in other units, or of another sign, than the model

Inside a sample loop nothing raises: there a status says what is wrong with the estimate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


class EstimatorError(Exception):
    """Base of every error of this package; never raised itself."""


class BadShape(EstimatorError, ValueError):
    """An array has the wrong shape or holds values that are not finite: the caller is at fault."""


class BadModel(EstimatorError, ValueError):
    """A model names unknown parameters or effects, misses some, or is non-physical."""


class BadSetting(EstimatorError, ValueError):
    """A setting is outside what its algorithm can work with: the caller is at fault.

    Examples: a shift register that starts at zero, a sampling period that does not divide the wanted one.
    To do: give a value of the kind the message names.
    """


class NotExciting(EstimatorError):
    """The data do not determine what was asked.

    Attributes
    ----------
    names : tuple[str, ...]
        What can't be determined.
    """

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


def made_of_each(
    items: Iterable[Item], make: Callable[[Item], Result], fault: type[Exception], joined: Callable[[str], Exception]
) -> list[Result]:
    """Return what is made of each of several recordings; refuse all that are at fault together."""
    made: list[Result] = []
    faults: list[Exception] = []
    for item in items:
        try:
            made.append(make(item))
        except fault as error:
            faults.append(error)
    if not faults:
        return made
    refusal = faults[0] if len(faults) == 1 else joined("\n".join(map(str, faults)))
    if made:
        refusal.add_note(f"Correct or leave out what is named; recordings without such a fault: {len(made)}.")
    raise refusal


@dataclass(frozen=True, slots=True)
class Cure:
    """What would make a recording and a model agree: factors for its readings, or two channels that are swapped.

    Attributes
    ----------
    recording : str
        Name of the recording.
    torque : float
        For the torques.
    inputs : tuple of int
        The torque inputs it is for, from 0; empty for all.
    output, time : float
        For the measured output, and for the time.
    swapped : int or None
        The torque input that is swapped with the output.
    kind : str or None
        What the output is instead: a position, or a speed.
    dropped : int or None
        The torque input that does not count.
    columns, is_instead : tuple of str, bool
        Columns that are torques, too, and whether they are it in the place of those named.
    """

    recording: str
    torque: float = 1.0
    inputs: tuple[int, ...] = ()
    output: float = 1.0  # factor on the measured output
    time: float = 1.0  # factor on the time stamps
    swapped: int | None = None
    kind: str | None = None
    dropped: int | None = None
    columns: tuple[str, ...] = ()  # names in the file
    is_instead: bool = False


class Implausible(EstimatorError, ValueError):
    """Recordings and model contradict each other as only a wrong unit, scale or sign makes them.

    Examples: a speed in rpm where rad/s are expected, a torque of the wrong sign. To do: correct the scale in
    ``[signals]``, or the model.

    Attributes
    ----------
    cure : Cure or None
        What to correct, where that is known.
    """

    def __init__(self, message: str, cure: Cure | None = None) -> None:
        super().__init__(message)
        self.cure = cure
