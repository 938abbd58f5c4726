"""The clock of a CAN adapter that counts from its own start: its stamps become times of the system's clock.

What python-can's code for each interface gives as ``Message.timestamp`` (4.6): gs_usb, canalystii, serial and systec a
32-bit counter since the adapter's start; pcan (without the package uptime), etas and cantact the time since some start;
usb2can a number without a stated unit; all others seconds since 1970.
"""

from collections.abc import Mapping
from typing import Final

from gateway.records import FIRST_DATED_NS
from gateway.units import NS_PER_S

COUNTER_S: Final[Mapping[str, float]] = {  # after so long the counter of the interface begins again at 0
    "gs_usb": 2**32 * 1e-6,  # 72 min
    "canalystii": 2**32 * 1e-4,  # 5 days
    "serial": 2**32 * 1e-3,  # 50 days
    "systec": 2**32 * 1e-3,
}
NO_UNIT: Final = frozenset({"usb2can"})
PAUSE_S: Final = 5.0  # chosen: between two stamps: longer than any message's period, shorter than what ends a drive
MOST_OFF_S: Final = 10.0  # chosen: more than an adapter drifts in a day (50 ppm: 4 s) and than a computer stalls


class AdapterClock:
    """Dates the stamps of one opened channel.

    A stamp before 1986 counts from the adapter's start. The system's clock at the first of these dates it; from there
    on the adapter's own clock counts, and a counter that begins again is continued. After a pause of the bus, a new
    start of the adapter or a step of the system's clock the system's clock dates again.
    """

    def __init__(self, interface: str = "") -> None:
        self._counter_s = COUNTER_S.get(interface)
        self._has_unit = interface not in NO_UNIT
        self._start_s = 0.0  # of the adapter, since 1970
        self._last_s: float | None = None
        self.n_set = 0  # times the system's clock dated the stamps
        self.n_wraps = 0  # times the counter began again

    def dated_s(self, stamp_s: float, now_s: float) -> float:
        """Seconds since 1970 of a stamp; ``now_s`` is the system's clock at its receipt."""
        if not self._has_unit:
            return now_s
        if stamp_s * NS_PER_S >= FIRST_DATED_NS:
            return stamp_s
        step_s = 0.0 if self._last_s is None else stamp_s - self._last_s
        self._last_s = stamp_s
        if self._counter_s is not None:
            n_wraps = -round(step_s / self._counter_s)
            step_s += n_wraps * self._counter_s
            self._start_s += n_wraps * self._counter_s
            self.n_wraps += n_wraps
        if abs(step_s) > PAUSE_S or abs(self._start_s + stamp_s - now_s) > MOST_OFF_S:
            self._start_s = now_s - stamp_s
            self.n_set += 1
        return self._start_s + stamp_s
