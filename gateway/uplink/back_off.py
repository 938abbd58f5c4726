"""How long to wait before trying again: longer each time, and never all vehicles at once."""

import random


class BackOff:
    """Exponential with full jitter: uniform between nothing and a ceiling that doubles up to ``last_s``.

    Source: M. Brooker, "Exponential Backoff And Jitter", AWS Architecture Blog, 2015.
    """

    def __init__(self, first_s: float, last_s: float, draw: random.Random | None = None) -> None:
        self._first_s = first_s
        self._last_s = last_s
        self._ceiling_s = first_s
        self._draw = draw or random.Random()  # of the system's entropy: vehicles must not agree

    def next_s(self) -> float:
        """The next pause."""
        pause_s = self._draw.uniform(0.0, self._ceiling_s)
        self._ceiling_s = min(2.0 * self._ceiling_s, self._last_s)
        return pause_s

    def reset(self) -> None:
        """It worked: the next failure is a first one again."""
        self._ceiling_s = self._first_s
