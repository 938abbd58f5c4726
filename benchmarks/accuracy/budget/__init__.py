"""Does the error of an estimate agree with its budget: each source alone, then all at once.

``nature`` draws differences from the calibration, each from its stated distribution; ``alone`` drives with one of these
and without it, ``together`` with all of them; ``page`` writes the page.
"""

from benchmarks.accuracy.budget.alone import alone
from benchmarks.accuracy.budget.page import budget_page
from benchmarks.accuracy.budget.together import together

SEED = 20_310  # arbitrary, of this study alone

__all__ = ["SEED", "alone", "budget_page", "together"]
