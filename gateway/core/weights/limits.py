"""When a weight counts as over its limit."""

import math
from collections.abc import Iterable
from typing import Final

RELEASE_SHARE: Final = 0.03  # of the limit: how far a load must fall below it before a warning ends


def is_over_limit(weights_kg: Iterable[float], limit_kg: float | None) -> bool:
    """Whether the last of a series of weights counts as over the limit, with hysteresis.

    A warning begins above the limit and ends 3 % below it, so that an estimate that wavers about the
    limit does not make it flicker. No limit, or no known weight: no warning.
    """
    is_over = False
    for weight_kg in weights_kg:
        if limit_kg is None or math.isnan(weight_kg):
            continue
        is_over = weight_kg > limit_kg * (1.0 - RELEASE_SHARE if is_over else 1.0)
    return is_over
