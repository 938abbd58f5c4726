"""The batch scheduler: cuts the stream of decoded rows into drives, and drives into windows.

Its decisions depend on the rows and their order alone, not on how they were chunked or on any clock. So the live
service and the offline tools form the same batches.
"""

from collections.abc import Generator, Iterator
from copy import copy

import numpy as np

from gateway.core.batch import BatchWindow, Traits, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.journey import watched_all, way_of
from gateway.estimates.batch_estimate import UNWATCHED, Watched, Way
from gateway.records import ASIDE, I64, Batch, Bool, Motion, Signal, Why, joined
from gateway.units import NS_PER_S

_NEVER_NS = int(np.iinfo(np.int64).max)  # later than any stamp
_MOVING = _NEVER_NS  # "standing since never"
_SPEEDS = (Signal.SPEED, Signal.WHEEL_SPEED)
_MOST_ROWS_PER_S = 3000  # chosen: no bus carries more of an inertial sensor; only stuck time stamps reach it
_MOST_ROWS = 1_500_000  # chosen: of a window, for bounded memory
_LOOSE = 512  # chosen: small parts merged into one, because each part has a fixed cost


class Scheduler:
    """Feed it rows in order of arrival; it yields a Batch whenever a window ends.

    A drive begins with the first row. It ends after ``standstill_s`` of standstill, after ``silence_s`` without a row,
    at a backward step of the clock, or when time stamps hardly advance: a window holds no more rows than a bus can
    carry in its time. Windows follow one another from the first row. After a standstill the next drive begins when the
    vehicle moves again. ``n_late_rows`` counts rows that come after their window. Rows with nothing but a roll rate,
    and rows aside, are kept but decide nothing; the number of rows aside is limited like that of the others.
    """

    def __init__(self, settings: BatchSettings, traits: Traits) -> None:
        self._settings = settings
        self._traits = traits
        self._rows: list[Motion] = []
        self._loose: list[Motion] = []
        self._n_rows = self._n_aside = 0
        self._most_rows = min(_MOST_ROWS, round(settings.window_s * _MOST_ROWS_PER_S))
        self._drive_start_ns = 0
        self._window_start_ns = 0
        self._provisional_ns = 0
        self._newest_ns: int | None = None  # None between drives
        self._still_since_ns: int = _MOVING
        self._between: Watched = UNWATCHED  # door and ignition since the last drive ended
        self._before: Watched = UNWATCHED  # the same before the open window, if it is the drive's first
        self.is_parked = False
        self.n_late_rows = 0
        self._rows_of_last: Motion | None = None
        self.way_of_last = Way()  # of the batch yielded last

    @property
    def silence_s(self) -> float:
        """Silence (s) that ends a drive."""
        return self._settings.silence_s

    @property
    def drive_start_ns(self) -> int | None:
        """Start of the current drive; None between drives. Safe from any thread."""
        return None if self._newest_ns is None else self._drive_start_ns

    @property
    def newest_ns(self) -> int | None:
        """The newest stamp of the current drive; None between drives. Safe from any thread."""
        return self._newest_ns

    @property
    def open_window_ns(self) -> tuple[int, int] | None:
        """Begin of the open window and its newest stamp; None between drives. Safe from any thread."""
        newest_ns = self._newest_ns
        return None if newest_ns is None else (self._window_start_ns, max(self._window_start_ns, newest_ns))

    def take_rows(self) -> Motion:
        """The rows of the batch yielded last, possibly with rows beyond its window. Can be taken once. Raises
        ValueError if there is none.
        """
        rows, self._rows_of_last = self._rows_of_last, None
        if rows is None:
            raise ValueError("no batch was yielded since rows were last taken")
        return rows

    def branch(self) -> "Scheduler":
        """An independent copy that continues from here."""
        other = copy(self)
        other._rows, other._loose = list(self._rows), list(self._loose)
        return other

    def feed(self, motion: Motion) -> Iterator[Batch]:
        """Take rows in order of arrival; yield the batches that end with them."""
        begin = 0
        while begin < len(motion):
            if self.is_parked:
                begin += self._skip_until_moving(motion.part(begin, len(motion)))
            else:
                begin += yield from self._advance(motion.part(begin, len(motion)))

    def flush(self, ended_by: Why | None = None) -> Iterator[Batch]:
        """Close the open window, because the stream ended or broke."""
        if self._newest_ns is not None:
            yield from self._end_drive(self._newest_ns, ended_by)

    def _advance(self, motion: Motion) -> Generator[Batch, None, int]:
        """Take rows up to the end of the drive or of the rows; return how many were taken."""
        decides = _decides(motion)
        if self._newest_ns is None:
            if not decides[0]:
                n = int(np.argmax(decides)) if decides.any() else len(motion)
                self._between = self._between.joined(watched_all([motion.part(0, n)]))
                return n
            self._drive_start_ns = self._newest_ns = int(motion.t_ns[0])
            self._still_since_ns = _MOVING
            self._begin_window(self._newest_ns)
            self._before, self._between = self._between, UNWATCHED
        last = np.maximum.accumulate(np.where(decides, np.arange(len(motion)), -1))
        t_ns = np.where(last >= 0, motion.t_ns[last], self._newest_ns)  # of the last row that decides
        n, broken_by = self._next_break(t_ns)
        newest_ns = np.maximum.accumulate(np.r_[self._newest_ns or 0, t_ns[:n]])[1:]
        still_since_ns = self._standing_since(motion.part(0, n))
        parked = np.flatnonzero(newest_ns - still_since_ns >= self._ns(self._settings.standstill_s))
        if parked.size:
            n = int(parked[0])
        yield from self._cut(motion.part(0, n), newest_ns[:n])
        if parked.size:
            yield from self._end_drive(int(still_since_ns[n]) + self._ns(self._settings.standstill_s))
            self.is_parked = True
        elif broken_by is not None:
            yield from self._end_drive(self._newest_ns or 0, broken_by)
        else:
            self._still_since_ns = int(still_since_ns[-1])
        return n

    def _next_break(self, t_ns: I64) -> tuple[int, Why | None]:
        """Index of the first row after silence or a backward clock step, and which of both; all rows and None without
        one.
        """
        newest_ns = np.maximum.accumulate(np.r_[self._newest_ns or 0, t_ns])[:-1]
        ahead_ns = t_ns - newest_ns
        is_silence = ahead_ns > self._ns(self._settings.silence_s)
        broken = np.flatnonzero(is_silence | (ahead_ns < -self._ns(self._settings.clock_step_s)))
        if not broken.size:
            return len(t_ns), None
        first = int(broken[0])
        return first, Why.GAP if is_silence[first] else Why.CLOCK_STEP

    def _standing_since(self, rows: Motion) -> I64:
        """(n,) time since which the vehicle stands, by the speeds up to each row; _MOVING if it moves."""
        moving, still = self._moving_and_still(rows)
        at = np.arange(len(rows))
        last_moving = np.maximum.accumulate(np.where(moving, at, -1))
        last_still = np.maximum.accumulate(np.where(still, at, -1))
        stood_before = self._still_since_ns != _MOVING
        stands = (last_still > last_moving) | ((last_moving < 0) & stood_before)
        begins = still & ~np.r_[stood_before, stands[:-1]]
        last_begin = np.maximum.accumulate(np.where(begins, at, -1))
        since_ns = np.where(last_begin >= 0, rows.t_ns[last_begin], self._still_since_ns)
        return np.where(stands, since_ns, _MOVING)

    def _moving_and_still(self, rows: Motion) -> tuple[Bool, Bool]:
        """(n,) rows whose speeds say that the vehicle moves, and (n,) that it stands; neither without a speed."""
        speeds = [rows.columns[:, rows.signals.index(s)] for s in _SPEEDS if s in rows.signals]
        fastest = np.fmax.reduce([np.full(len(rows), np.nan), *speeds])
        return fastest >= self._settings.standstill_speed_mps, fastest < self._settings.standstill_speed_mps

    def _cut(self, rows: Motion, newest_ns: I64) -> Iterator[Batch]:
        """Keep the unbroken rows of one drive, and cut them at window ends and provisional marks."""
        begin = 0
        while begin < len(rows):
            mark_ns = self._next_mark_ns()
            end = int(np.searchsorted(newest_ns, mark_ns, side="left"))
            end = min(end, begin + self._n_that_fit(rows, begin))
            if end > begin:
                self._keep(rows.part(begin, end))
                self._newest_ns = int(newest_ns[end - 1])
                begin = end
            if begin < len(rows):
                if newest_ns[begin] >= mark_ns:
                    yield self._reach(mark_ns)
                else:  # the window is full: it ends at its newest stamp, at least a nanosecond after its start
                    yield self._end_window(max(self._newest_ns or 0, self._window_start_ns + 1), Why.TIME_STAMPS)

    def _n_that_fit(self, rows: Motion, begin: int) -> int:
        """The number of rows from ``begin`` on that the window can still hold; rows aside do not count."""
        n_left = self._most_rows - self._n_rows
        if rows.aside is None:
            return n_left
        return int(np.searchsorted(np.cumsum(~rows.aside[begin:]), n_left, side="right"))

    def _keep(self, part: Motion) -> None:
        if part.aside is not None:
            part = part.rows(~part.aside | (np.cumsum(part.aside) <= self._most_rows - self._n_aside))
        n_aside = 0 if part.aside is None else int(np.count_nonzero(part.aside))
        is_late = part.t_ns < self._window_start_ns
        self.n_late_rows += int(np.count_nonzero(is_late if part.aside is None else is_late & ~part.aside))
        self._n_rows += len(part) - n_aside
        self._n_aside += n_aside
        self._loose.append(part)
        if len(self._loose) == _LOOSE:
            self._rows.append(joined(self._loose))
            self._loose = []

    def _next_mark_ns(self) -> int:
        window_end_ns = min(self._window_start_ns + self._ns(self._settings.window_s), _NEVER_NS)
        return min(window_end_ns, self._provisional_ns) if self._settings.provisional_every_s else window_end_ns

    def _reach(self, mark_ns: int) -> Batch:
        """A row at or after ``mark_ns`` has come: end the window there, or build a provisional batch."""
        if mark_ns < self._window_start_ns + self._ns(self._settings.window_s):
            self._provisional_ns += self._ns(self._settings.provisional_every_s)
            return self._build(mark_ns, is_provisional=True)
        return self._end_window(mark_ns)

    def _end_window(self, t_end_ns: int, ended_by: Why | None = None) -> Batch:
        batch = self._build(t_end_ns, ended_by)
        self._begin_window(t_end_ns)
        self._before = UNWATCHED
        return batch

    def _begin_window(self, t_ns: int) -> None:
        self._rows = [part.part(0, 0) for part in (*self._rows, *self._loose)[:1]]  # one without rows has signals too
        self._loose, self._n_rows, self._n_aside = [], 0, 0
        self._window_start_ns = t_ns
        self._provisional_ns = t_ns + self._ns(self._settings.provisional_every_s)

    def _end_drive(self, t_end_ns: int, ended_by: Why | None = None) -> Iterator[Batch]:
        t_end_ns = min(t_end_ns, self._window_start_ns + self._ns(self._settings.window_s), _NEVER_NS)
        if t_end_ns > self._window_start_ns:
            yield self._build(t_end_ns, ended_by)
        kept = [*self._rows, *self._loose]
        self._between = watched_all([part.rows(part.t_ns >= t_end_ns) for part in kept])
        self._rows, self._loose, self._n_rows, self._n_aside = [], [], 0, 0
        self._newest_ns = None

    def _skip_until_moving(self, motion: Motion) -> int:
        """The number of rows to skip until the vehicle moves; a moving row ends the parked state."""
        moving = np.flatnonzero(self._moving_and_still(motion)[0])
        n = int(moving[0]) if moving.size else len(motion)
        self._between = self._between.joined(watched_all([motion.part(0, n)]))
        self.is_parked = not moving.size
        return n

    def _build(self, t_end_ns: int, ended_by: Why | None = None, *, is_provisional: bool = False) -> Batch:
        self._rows, self._loose = [joined([*self._rows, *self._loose])], []
        self._rows_of_last = self._rows[0]
        window = BatchWindow(self._window_start_ns, t_end_ns, self._drive_start_ns, ended_by, is_provisional)
        batch = build_batch(self._rows[0], window, self._settings, self._traits)
        self.way_of_last = way_of(self._rows[0], batch, self._settings, self._traits, self._before)
        return batch

    @staticmethod
    def _ns(duration_s: float) -> int:
        return round(duration_s * NS_PER_S)


def _decides(rows: Motion) -> Bool:
    """(n,) False for rows that do not affect drives and windows: rows aside, and rows with nothing but a roll rate."""
    decides: Bool = np.ones(len(rows), bool) if rows.aside is None else ~rows.aside
    if Signal.ROLL_RATE not in rows.signals:
        return decides
    known = np.isfinite(rows.columns[:, [signal not in ASIDE for signal in rows.signals]])
    has_roll = np.isfinite(rows.columns[:, rows.signals.index(Signal.ROLL_RATE)])
    decides &= ~has_roll | (np.count_nonzero(known, axis=1) > 1)
    return decides
