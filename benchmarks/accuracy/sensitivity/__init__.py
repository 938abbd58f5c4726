"""The effect of the chosen constants: each is halved and doubled, on the same fresh vans.

``constants`` lists them and sets them temporarily, ``study`` calibrates and weighs with each, ``changes`` finds the
smallest detectable change of load, ``page`` writes the page.
"""

from benchmarks.accuracy.sensitivity.constants import CONSTANTS
from benchmarks.accuracy.sensitivity.page import sensitivity_page
from benchmarks.accuracy.sensitivity.study import SEED, sensitivity

__all__ = ["CONSTANTS", "SEED", "sensitivity", "sensitivity_page"]
