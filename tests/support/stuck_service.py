"""``python -m support.stuck_service run --config FILE``: a service whose pipeline never ends, busy in compiled code."""

import threading
from collections.abc import Iterable

import numpy as np
import scipy.fft

from gateway.cli import main
from gateway.estimates.batch_estimate import Estimate
from gateway.service import gateway
from gateway.weighing.flow import Flow

N_THREADS = 3  # so that one of them is inside whenever the process ends


def spin() -> None:
    """Loops without end in code that releases Python's lock."""
    samples = np.ones((64, 600))
    while True:
        scipy.fft.rfft(samples)


def never_flush(_flow: Flow) -> Iterable[Estimate]:
    """The last window is never closed."""
    for _ in range(N_THREADS - 1):
        threading.Thread(target=spin, daemon=True).start()
    spin()
    return ()


if __name__ == "__main__":
    Flow.flush = never_flush  # type: ignore[assignment,method-assign]  # a fault, put in
    gateway.PIPELINE_WITHIN_S = 0.2
    main()
