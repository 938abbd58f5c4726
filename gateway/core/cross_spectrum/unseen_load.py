"""What something about the load that nobody sees adds to the answer: where it lies sideways, how long it lies."""

from typing import Final

import numpy as np

from gateway.records import F64

MOST_FEEDBACK: Final = 0.5  # beyond, proportion no longer tells; chosen, it doubles the standard deviation


def unseen_covariance(moved: F64, payload_kg: float) -> F64:
    """(2, 2) of payload (kg) and front share (0..1), which ``moved`` (2,) with a standard deviation of what is unseen.

    The load that lies so is the true one: where the answer ``payload_kg`` fell short of it, it is the larger, and moves
    the answer by more.
    """
    feedback = min(abs(float(moved[0])) / payload_kg, MOST_FEEDBACK) if payload_kg > 0.0 else 0.0
    covariance: F64 = np.outer(moved, moved) / (1.0 - feedback) ** 2
    return covariance
