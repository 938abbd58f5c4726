"""Calibration of a line of vehicles: sister vehicles' drives give the prior of the next one, so that one empty drive is
enough.

Each sister's drives are evidence on the line; the scatter between vehicles widens it; the next vehicle starts from
there (``line_of``, ``Line.prior_of``). With three sisters or more the scatter itself is estimated. Siblings left out in
turn show how far intervals must be widened (``with_siblings_left_out``).
"""
