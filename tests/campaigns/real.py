"""``python -m tests.campaigns.real real.json``: what `hil prove real` found, as the two tables of docs/how-good.md.

The first has each verdict and the error on held-out data, of the nominal model re-tuned and of the model that the
diagnosis wrote; the second each value that is known of a machine, next to the one that was found.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FINER = {"m": ("mm", 1e3), "N": ("kN", 1e-3)}  # of errors, so that they are read without a power of ten


def verdicts(cases: list[dict[str, Any]]) -> Iterator[str]:
    """Write a row for each run."""
    yield "| case, recordings of the fit | concealed | verdict | held out: before → after | right |"
    yield "| --- | --- | --- | --- | --- |"
    for case in cases:
        concealed = ", ".join(f"`{name}`" for name in case["concealed"]) or "nothing"
        for run in case["runs"]:
            names = ": " + ", ".join(f"`{name}`" for name in run["named"]) if run["named"] else ""
            doubt = ", the input in doubt" if "in doubt" in run["statement"].split(":")[0] else ""
            unit, times = FINER.get(run["unit"], (run["unit"], 1.0))
            before, after = (times * run["held_out"][when] for when in ("before", "after"))
            right = (
                "yes" if run["named"] == case["concealed"] or set(run["named"]) == set(case["concealed"]) else "**no**"
            )
            yield (
                f"| `{case['name']}`, {run['name']} | {concealed} | `{run['verdict']}`{names}{doubt} | "
                f"{before:.3g} → {after:.3g} {unit} | {right} |"
            )


def values(cases: list[dict[str, Any]]) -> Iterator[str]:
    """Write a row for each value that is known."""
    yield "| value | published or withheld | found | 95 % interval | inside |"
    yield "| --- | --- | --- | --- | --- |"
    for case in cases:
        for run in case["runs"]:
            for each in run["agreements"]:
                found = "not named" if each["found"] is None else f"{each['found']:.4g} {each['unit']}"
                interval = "" if each["ci95"] is None else "{:.4g} to {:.4g}".format(*each["ci95"])
                inside = "yes" if each["inside"] else "**no**"
                value = f"`{case['name']}`, {run['name']}: {each['what']}"
                yield f"| {value} | {each['truth']:.4g} {each['unit']} | {found} | {interval} | {inside} |"


def main(path: Path) -> int:
    """Print both tables."""
    cases = json.loads(path.read_text("utf-8"))["cases"]
    print("\n".join([*verdicts(cases), "", *values(cases)]))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
