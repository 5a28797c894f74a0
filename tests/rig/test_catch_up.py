"""The base torque after missing cycles: no faster than the guard lets it, and as planned as soon as it can be."""

from hil.rig.catch_up import CatchUp

MOST_NM = 20.0


def asked(planned_nm: dict[int, float]) -> list[float]:
    """Torques asked for in cycles, by number, whose plan is given [Nm]."""
    catch_up = CatchUp(MOST_NM)
    return [catch_up.torque_nm(cycle, torque_nm) for cycle, torque_nm in planned_nm.items()]


def test_a_plan_without_missing_cycles_is_left_alone_however_fast() -> None:
    assert asked({0: 0.0, 1: 10.0, 2: 500.0, 3: -500.0}) == [0.0, 10.0, 500.0, -500.0]


def test_the_first_cycle_has_none_before_it() -> None:
    assert asked({7: 300.0, 8: 400.0}) == [300.0, 400.0]


def test_one_missing_cycle_is_enough() -> None:
    assert asked({0: 0.0, 2: 50.0}) == [0.0, 20.0]


def test_it_takes_as_many_cycles_as_the_rate_wants_both_ways() -> None:
    for sign in (1.0, -1.0):
        planned = {0: 0.0, 5: 70.0, 6: 75.0, 7: 80.0, 8: 85.0, 9: 85.0, 10: 300.0}
        expected = [0.0, 20.0, 40.0, 60.0, 80.0, 85.0, 300.0]
        assert asked({k: sign * torque_nm for k, torque_nm in planned.items()}) == [sign * each for each in expected]


def test_a_step_as_large_as_the_rate_allows_is_none_to_catch_up_with() -> None:
    assert asked({0: 0.0, 2: MOST_NM, 3: 500.0}) == [0.0, MOST_NM, 500.0]


def test_missing_cycles_while_catching_up() -> None:
    assert asked({0: 0.0, 3: 100.0, 6: 100.0, 7: 0.0}) == [0.0, 20.0, 40.0, 20.0]
