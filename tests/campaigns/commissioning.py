"""``python -m tests.campaigns.commissioning [FIRST BEYOND]``: rigs with one effect concealed, commissioned.

Each rig is drawn from its seed and served by a process of its own, which keeps the truth sealed until it is asked;
``hil commission`` gets its addresses alone: no model, no data sheet. Then the seal is opened. Right is where the
concealed effect, or a look-alike given with it, is named and nothing else is. Prints a line for each rig, and the
counts. A rig takes some minutes of a processor.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from hil.child import environment, python
from hil.cli.main import ExitStatus
from hil.proof.judge import Outcome, judge
from hil.proof.rigs import rig_text, sealed_process
from hil.proof.seal import verify
from hil.proof.sealed_rig import CONCEALED

RIGS = 20
EFFECTS = tuple(name for name in CONCEALED if name not in ("none", "road_grade"))
"""What is concealed: a grade lets go of a bus at standstill, and commissioning ends there with a word about it."""

LIMIT_S = 3600.0

CALLS = 4
"""A simulated drive misses a heartbeat where the machine is busy; called again, the command continues there."""


def effect_of(seed: int) -> str:
    """Draw what is concealed; the rig's own process draws its size, and the vehicle."""
    return random.Random(seed).choice(EFFECTS)


def commissioned(seed: int, folder: Path) -> tuple[Outcome | None, tuple[str, ...], tuple[str, ...]]:
    """Commission one rig; return how it ended (None: not to its diagnosis), what was concealed, what was named."""
    with sealed_process("--seed", str(seed), "--effect", effect_of(seed), "--on-rollers") as sealed:
        text = rig_text(sealed).replace("heartbeat_ms = 100", "heartbeat_ms = 1000")  # they go by the wall clock
        (folder / "rig.toml").write_text(text, encoding="utf-8")
        out = folder / "out"
        words = ["commission", str(folder / "rig.toml"), "--out", str(out), "--yes", "--pace", "fast"]
        with (folder / "log.txt").open("w") as log:
            for _ in range(CALLS):
                done = subprocess.run(
                    python("-m", "hil", *words), stdout=log, stderr=log, env=environment(), timeout=LIMIT_S, check=False
                )
                if done.returncode != ExitStatus.DEVICE_FAULT:
                    break
        truth = verify(sealed.commitment, sealed.open())
    found = out / "diagnosis" / "diagnosis.json"
    if not found.exists():
        return None, (str(truth["effect"]),), ()
    judgement = judge(json.loads(found.read_text(encoding="utf-8")), truth)
    return judgement.outcome, judgement.hidden, judgement.named


def main(first: int, beyond: int) -> int:
    right = more = 0
    for seed in range(first, beyond):
        with tempfile.TemporaryDirectory() as folder:
            outcome, hidden, named = commissioned(seed, Path(folder))
        alone = outcome is Outcome.RIGHT and len(named) == len(hidden)
        right, more = right + alone, more + (len(named) > len(hidden))
        said = "no diagnosis" if outcome is None else outcome.name.lower()
        print(f"{seed}: concealed {', '.join(hidden)}; named {', '.join(named) or 'nothing'}: {said}", flush=True)
    print(f"the effect alone in {right} of {beyond - first}, a second name in {more}")
    return 0 if more == 0 else 1


if __name__ == "__main__":
    sys.exit(main(*(map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (1, 1 + RIGS))))
