"""Does the error of an estimate agree with its budget: each source alone, then all at once.

``nature`` draws differences from the calibration, each from its stated distribution; ``alone`` drives with one of these
and without it (``response`` predicts the shift), ``together`` with all of them; ``study`` runs both and writes
the page.
"""
