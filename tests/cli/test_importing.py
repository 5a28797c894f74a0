"""What a command imports is left out of the garbage collector's rounds, and the collector is as it was."""

from __future__ import annotations

import gc

import pytest

from hil.cli.importing import lasting_imports


def test_nothing_is_collected_while_modules_are_made_and_what_was_made_is_left_out_later() -> None:
    gc.unfreeze()
    try:
        with lasting_imports():
            assert not gc.isenabled()
            made = [[] for _ in range(1000)]
        assert gc.isenabled()
        assert gc.get_freeze_count() > len(made)
    finally:
        gc.unfreeze()


@pytest.mark.parametrize("enabled", [True, False])
def test_an_import_that_fails_leaves_the_collector_as_it_was(enabled: bool) -> None:
    (gc.enable if enabled else gc.disable)()
    try:
        with pytest.raises(ImportError), lasting_imports():
            raise ImportError
        assert gc.isenabled() is enabled
    finally:
        gc.enable()
