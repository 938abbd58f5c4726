"""What a line tells of its next vehicle: simulated siblings calibrated in six ways, on the same drives.

``drives`` draws lines, siblings and what they drive, ``study`` calibrates and judges, ``page`` makes a page
of it.
"""

from benchmarks.accuracy.siblings.page import siblings_page
from benchmarks.accuracy.siblings.study import SEED, siblings

__all__ = ["SEED", "siblings", "siblings_page"]
