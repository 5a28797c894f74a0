"""What the keys do, in a line and on a page."""

from __future__ import annotations

from hil.monitor.layout import PAGES

DRIVING_KEYS = "e start  SPACE stop  m mark  r reset  "

VIEWING_KEYS = "+/- time  ? help  q quit"

SCROLL_KEYS = "↑↓ scroll  ? help  q quit"

HELP = """\
e         choose an experiment of the rig file and start it; asks first
SPACE, x  stop at once: zero torque, drives disarmed
m         mark this moment; the mark goes into the recording
r         reset the drives' faults, configure them again; at rest only
1 to 5    overview, model, resonance, bus, log; TAB the next
+ -       signals over a shorter or a longer time
arrows    back and forth in the log; Page Up and Page Down too
q         quit; a run ends at zero torque first; Ctrl-C does the same

STALE     older than it should be; NO NEWS: nothing comes any more
silent    did not answer in time
FLAGGED   samples of a late cycle, or of one in which someone was
          silent: gaps in the plots, and the estimate does without
UNSURE    the ± (two standard deviations) is more than half the value
twist     estimated from torque and speed with a two-mass model; a
          backlash's free play is not in it
                                                       ? or Esc: back"""


def key_line(page: str, can_drive: bool) -> str:
    """Name the keys that do something on a page, and the page among its fellows."""
    driving = DRIVING_KEYS if can_drive else "a recording is played  "
    here = f"TAB page {PAGES.index(page) + 1}/{len(PAGES)}  "
    return driving + here + (SCROLL_KEYS if page == "log" else VIEWING_KEYS)
