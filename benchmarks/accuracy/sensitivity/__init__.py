"""How much hangs on the constants that no derivation gives: each halved and doubled, on the same fresh vans.

``constants`` lists them and sets them for a while, ``study`` calibrates and weighs with each, ``changes`` says which
change of load two batches would show, ``page`` makes a page of it.
"""

from benchmarks.accuracy.sensitivity.constants import CONSTANTS
from benchmarks.accuracy.sensitivity.page import sensitivity_page
from benchmarks.accuracy.sensitivity.study import SEED, sensitivity

__all__ = ["CONSTANTS", "SEED", "sensitivity", "sensitivity_page"]
