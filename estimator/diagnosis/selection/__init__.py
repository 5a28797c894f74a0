"""Which effects are missing: forward addition and backward removal, each step judged by five tests.

An effect earns its place when

1. information: the BIC gains more than ``VERY_STRONG`` (residual correlation taken into account);
2. chance: its p-value, times the number of hypotheses tried (Bonferroni), is below ``SIGNIFICANT``;
3. null: the 95 % interval of its decisive parameter excludes the value at which it does nothing;
4. unseen data: the error on held-out samples falls;
5. weight: it removes a part of the mismatch that is more than the difference between two ways to write one law.
"""

from __future__ import annotations

from estimator.diagnosis.selection.jury import Jury
from estimator.diagnosis.selection.outcome import Selection, survey
from estimator.diagnosis.selection.selector import Selector

__all__ = ["Jury", "Selection", "Selector", "survey"]
