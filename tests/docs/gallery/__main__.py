"""Provoke the failures anew and bring docs/gallery.md and its pictures up to date.

``python -m tests.docs.gallery [NAME ...]``; all of them take a minute or two. With ``--check`` nothing is written, and
the exit status is 1 where the tool says something else than the page, numbers apart.
"""

import os
import sys
from collections.abc import Sequence

from tests.docs.gallery.case import skeleton, tell
from tests.docs.gallery.draw import picture
from tests.docs.gallery.page import FAILURES, PAGE, shown_of, shown_on_page, with_shown


def main(arguments: Sequence[str]) -> int:
    """Renew or check what is asked for; return the exit status."""
    os.environ["HIL_LOG"] = "off"
    check = "--check" in arguments
    stale = 0
    for name in [each for each in arguments if each != "--check"] or list(FAILURES):
        outcome = tell(FAILURES[name])
        shown = shown_of(name, outcome)
        if check:
            same = skeleton(shown) == skeleton(shown_on_page()[name])
            stale += not same
            sys.stdout.write(f"{name}: {'as shown' if same else 'says something else now:'}\n{'' if same else shown}")
            continue
        PAGE.write_text(with_shown(PAGE.read_text(encoding="utf-8"), name, shown), encoding="utf-8")
        drawn = "" if outcome.draw is None else f", {picture(name, outcome.draw)}"
        sys.stdout.write(f"{name}: status {outcome.status}{drawn}\n")
        sys.stdout.flush()
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
