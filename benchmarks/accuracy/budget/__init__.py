"""Is the error of an estimate made up as its budget says: each source alone, then all at once.

``nature`` draws what differs from the calibration, each from its stated distribution; ``alone`` drives with one of
these and without it, ``together`` with all of them; ``page`` makes a page of it.
"""

from benchmarks.accuracy.budget.alone import alone
from benchmarks.accuracy.budget.page import budget_page
from benchmarks.accuracy.budget.together import together

SEED = 20_310

__all__ = ["SEED", "alone", "budget_page", "together"]
