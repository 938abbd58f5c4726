"""Calibration of a whole line of vehicles: what sisters' drives tell of the next one, so that an empty one is enough.

Each sister's drives are evidence of the line; scatter between vehicles blurs it; the next vehicle starts from there
(``line_of``, ``Line.prior_of``). From three sisters on the scatter itself is estimated. Siblings left out
in turn tell how far intervals must be widened (``with_siblings_left_out``).
"""

from gateway.calibration.inheritance import Limits, Seen, Usual
from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.left_out import Sibling, TestedLine, with_siblings_left_out
from gateway.calibration.line.line import Line, Sister, line_of

__all__ = [
    "Evidence",
    "Limits",
    "Line",
    "Seen",
    "Sibling",
    "Sister",
    "TestedLine",
    "Usual",
    "line_of",
    "with_siblings_left_out",
]
