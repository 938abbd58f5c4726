"""The thread that follows the drift of the vehicle's parameters: it reads the new stored batches every hour."""

import json
import logging
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

from gateway.calibration.trend import FILE_NAME, Trend, TrendHistory, trends_of
from gateway.estimate_json import estimate_from_json
from gateway.log import Event, log_event
from gateway.part import ThreadPart
from gateway.records import json_line
from gateway.service.record_file import RecordFile
from gateway.service.verification.epochs import Ask
from gateway.setup import Subject

FIRST_S: Final = 30.0  # chosen: after the start, which has more urgent work
EVERY_S: Final = 3600.0  # chosen: a drift takes weeks
PAGE: Final = 200  # chosen: batches read at a time
PAUSE_S: Final = 0.2  # chosen: between two pages, so that a long history does not occupy a core

Zeros = Callable[[], Sequence[tuple[str, float]]]


class TrendService(ThreadPart):
    """Adds new batches to trend.json. After a failure of the store or the disk it tries again in an hour.

    Batches that are unread at a stop are read after the next start.
    """

    NAME = "trend"

    def __init__(self, directory: Path, subject: Subject, ask: Ask, zeros: Zeros) -> None:
        """``zeros`` gives times of the empty vehicle with the estimate by the calibration alone (kg), oldest first."""
        super().__init__("trend")
        self._subject = subject
        self._ask = ask
        self._zeros = zeros
        self._file = RecordFile(directory / FILE_NAME, TrendHistory())
        self._trends: tuple[Trend, ...] = ()
        self._judge()

    @property
    def fault(self) -> str | None:
        """Parameters that drift or are off their calibration, for people."""
        said = [sentence for trend in self._trends if (sentence := trend.sentence()) is not None]
        return "; ".join(said) or self._file.fault

    @property
    def trends(self) -> Sequence[Trend]:
        """The last judged trends: the same object until the next judgement."""
        return self._trends

    def state(self) -> str:
        """JSON: a TrendState."""
        return json_line(
            {"calibration_id": self._subject.calibration_id, "parameters": [asdict(trend) for trend in self._trends]}
        )

    def catch_up(self) -> None:
        """Read all new batches, and judge. Raises StoreError, TimeoutError or OSError."""
        history = before = self._file.record
        while not self._stopping.is_set():
            page = self._ask(limit=PAGE, cursor=history.cursor, with_spectra=False)
            estimates = [estimate_from_json(json.loads(item)) for item in page.items]
            history = history.with_batches(estimates, page.last_cursor)
            if page.next_cursor is None:
                break
            self._stopping.wait(PAUSE_S)
        if history != before:
            self._file.keep(history)
        self._judge()

    def _judge(self) -> None:
        calibrated = self._subject.calibrated
        mass_kg = 0.0 if calibrated is None else calibrated.vehicle.empty_mass_kg
        self._trends = trends_of(self._file.record.weeks, self._zeros(), self._subject.calibration_id, mass_kg)

    def _run(self) -> None:
        wait_s = FIRST_S
        while not self._stopping.wait(wait_s):
            wait_s = EVERY_S
            try:
                self.catch_up()
            except Exception as fault:  # noqa: BLE001 - store, disk, another version's records: none may end the thread
                log_event(Event.TREND_NOT_KEPT, level=logging.WARNING, fault=str(fault) or repr(fault))
