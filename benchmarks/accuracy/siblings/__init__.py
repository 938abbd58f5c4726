"""The benefit of a line for its next vehicle: simulated siblings calibrated in six ways, on the same drives.

``drives`` draws lines, siblings and their drives, ``study`` calibrates and judges, ``page`` writes the page.
"""

from benchmarks.accuracy.siblings.page import siblings_page
from benchmarks.accuracy.siblings.study import SEED, siblings

__all__ = ["SEED", "siblings", "siblings_page"]
