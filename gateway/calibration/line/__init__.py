"""Calibration of a whole line of vehicles: what sisters' drives tell of the next one, so that an empty one is enough.

Each sister's drives are evidence of the line; scatter between vehicles blurs it; the next vehicle starts from there
(``line_of``, ``Line.prior_of``). From three sisters on the scatter itself is estimated.
"""

from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.limits import Limits, Seen
from gateway.calibration.line.line import Line, Sister, line_of

__all__ = ["Evidence", "Limits", "Line", "Seen", "Sister", "line_of"]
