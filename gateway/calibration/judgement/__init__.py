"""The accuracy of a calibration: its estimates compared with the truth, and a verdict.

The outcome of a calibration, or batches of known load with a calibration file, come in. Out go the error table (12)
(``error_table``), the same by what calibration knew of the batches (``Assessment``), the coverage of intervals
(``coverage_of``) and a verdict with reasons (``verdicts_of``).
"""
