"""When a heartbeat has ended: overdue, and still so after a time in which the listener was awake."""

from drivers.canopen.silence import GRACE_NS, Silence

TIMEOUT_NS = 500
GRACE = 100
LOOK = 30
START_NS = 1_000_000
"""Of a clock that does not begin at zero."""


def listening(longest_look_ns: int | None = None) -> Silence:
    silence = Silence(TIMEOUT_NS, GRACE, longest_look_ns)
    silence.beat(START_NS)
    return silence


def test_at_the_time_out_it_is_not_overdue_and_one_later_it_is() -> None:
    silence = listening()
    at_ns = START_NS + TIMEOUT_NS
    assert not silence.has_ended(at_ns)
    assert not silence.has_ended(at_ns + GRACE)  # the first look that finds it overdue
    assert silence.has_ended(at_ns + 2 * GRACE)


def test_the_grace_counts_from_the_look_that_found_it_overdue() -> None:
    silence = listening()
    overdue_ns = START_NS + TIMEOUT_NS + 1
    assert not silence.has_ended(overdue_ns)
    assert not silence.has_ended(overdue_ns + GRACE - 1)
    assert silence.has_ended(overdue_ns + GRACE)


def test_a_long_time_between_two_looks_counts_as_the_longest_there_is() -> None:
    silence = listening(LOOK)
    overdue_ns = START_NS + TIMEOUT_NS + 1
    assert not silence.has_ended(overdue_ns)
    for later in range(1, 4):
        assert not silence.has_ended(overdue_ns + later * 10**9)
    assert silence.has_ended(overdue_ns + 4 * 10**9)


def test_short_looks_count_as_long_as_they_are() -> None:
    silence = listening(LOOK)
    overdue_ns = START_NS + TIMEOUT_NS + 1
    assert not any(silence.has_ended(overdue_ns + later) for later in range(0, GRACE, 5))
    assert silence.has_ended(overdue_ns + GRACE)


def test_a_beat_begins_the_grace_anew() -> None:
    silence = listening()
    overdue_ns = START_NS + TIMEOUT_NS + 1
    assert not silence.has_ended(overdue_ns)
    silence.beat(overdue_ns)
    assert not silence.has_ended(overdue_ns + TIMEOUT_NS + 1)
    assert silence.has_ended(overdue_ns + TIMEOUT_NS + 1 + GRACE)


def test_its_length_is_counted_from_the_last_beat() -> None:
    silence = Silence(TIMEOUT_NS)
    assert silence.length_ns(START_NS) == 0
    assert not silence.has_ended(START_NS)
    silence.beat(START_NS)
    assert silence.length_ns(START_NS + 7) == 7
    silence.end()
    assert silence.length_ns(START_NS + 7) == 0
    assert not silence.has_ended(START_NS + 10**9)


def test_without_a_word_the_grace_is_a_tenth_of_a_second() -> None:
    assert GRACE_NS == 100_000_000
    silence = Silence(TIMEOUT_NS)
    silence.beat(0)
    assert not silence.has_ended(TIMEOUT_NS + 1)
    assert not silence.has_ended(TIMEOUT_NS + GRACE_NS)
    assert silence.has_ended(TIMEOUT_NS + 1 + GRACE_NS)
