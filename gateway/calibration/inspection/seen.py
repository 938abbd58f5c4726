"""A drive as its checks see it: what several of them need is computed once."""

from collections.abc import Iterable, Iterator
from enum import StrEnum
from functools import cached_property
from typing import Final

from gateway.calibration.as_stated import stated_load
from gateway.calibration.inspection.axes import Phases, phases, reading_of
from gateway.calibration.inspection.finding import Finding, Severity
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.inspection.rows import Gravity, gravity_in
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.model.spectra import CrossSpectra, cross_spectra_of
from gateway.records import Batch, Signal, Why

SHAKING_MPS2: Final = 0.2  # chosen: a vehicle at rest with its engine running stays below
BELIEVED_AGREEMENT: Final = 0.92  # chosen: with this agreement the speed's unit is not tested
UNIT_GAIN: Final = 0.04  # chosen: gain of agreement that proves a wrong unit of speed
SPEED_MISREAD: Final = {  # how many times too high the speed then reads; a mile has 1.609344 km
    "its numbers are km/h, but the signal map says m/s": 3.6,
    "its numbers are m/s, but the signal map says km/h": 1.0 / 3.6,
    "its numbers are km/h, but the signal map says mph": 1.609344,
    "its numbers are mph, but the signal map says km/h": 1.0 / 1.609344,
}

Said = Iterator[str | tuple[str, Severity]]
"""The text of each finding; with its severity if that is not the gravest of its kind."""


class Part(StrEnum):
    """What a check looks at."""

    LOG = "the log"
    ROWS = "the rows, or the batches cut of them"
    SPECTRA = "the cross-spectra, if there are any and the vertical acceleration shows gravity"
    ROLL = "the cross-spectra with the roll rate"


class Seen:
    """A drive as its checks see it; what several of them need is computed once."""

    def __init__(self, drive: SplitRun, vehicle: Vehicle, settings: BatchSettings) -> None:
        self.drive, self.vehicle, self.settings = drive, vehicle, settings
        self.facts, self.streams, self.batches = drive.facts, drive.facts.streams, drive.batches
        self.found: list[Finding] = []

    @cached_property
    def gravity(self) -> Gravity:
        """What the vertical acceleration's mean shows."""
        return gravity_in(self.facts)

    @cached_property
    def measured(self) -> CrossSpectra | None:
        """The cross-spectra as read, with the roll rate if there is one; None without enough steady driving."""
        return cross_spectra_of(self.batches, reading_of(self.vehicle))

    def has(self, part: Part) -> bool:
        """Whether there is such a part to look at."""
        if part in (Part.LOG, Part.ROWS):
            return True
        is_seen = self.measured is not None and self.gravity.factor != 0.0
        return is_seen and (part is Part.SPECTRA or self.spectra.has_roll)

    @cached_property
    def spectra(self) -> CrossSpectra:
        """The same with the vertical acceleration mended. Raises ValueError without any."""
        if self.measured is None:
            raise ValueError("this drive has no cross-spectra")
        return self.measured.with_acceleration_times(self.gravity.factor)

    def phases(self, spectra: CrossSpectra) -> Phases:
        """How well these agree with a vehicle's, with the stated load or none."""
        return phases(spectra, stated_load(self.drive.run, self.vehicle), self.vehicle)

    @cached_property
    def as_read(self) -> Phases:
        """Of the spectra, with the speed as it reads."""
        return self.phases(self.spectra)

    @cached_property
    def misread(self) -> tuple[str, Phases] | None:
        """The mistake of the speed's unit that explains the phases far better than none, and its phases."""
        tried = {}
        for what, factor in SPEED_MISREAD.items() if self.as_read.best < BELIEVED_AGREEMENT else ():
            spectra = cross_spectra_of(self.batches, reading_of(self.vehicle, factor))
            if spectra is not None:
                tried[what] = self.phases(spectra.with_acceleration_times(self.gravity.factor))
        best = max(tried.items(), key=lambda one: one[1].best, default=None)
        return best if best is not None and best[1].best > self.as_read.best + UNIT_GAIN else None

    @property
    def corrected(self) -> Phases:
        """Of the spectra, with the likeliest speed."""
        return self.misread[1] if self.misread else self.as_read

    def share(self, *whys: Why) -> float:
        """Which part of the drive's time these causes masked."""
        total_s = sum(batch.duration_s for batch in self.batches)
        masked_s = sum(batch.shares.get(why, 0.0) * batch.duration_s for batch in self.batches for why in whys)
        return masked_s / total_s if total_s else 0.0

    def is_refused(self, signal: Signal, missing_share: float) -> bool:
        """Whether frames that do not fit the signal map explain that so much of the signal is missing."""
        shares = (share for _, share, signals in self.drive.log.mismatches if signal in signals)
        return 2.0 * max(shares, default=0.0) > missing_share

    @property
    def needed_s(self) -> float:
        """The shortest batch."""
        return self.settings.last_batch_share_min * self.settings.window_s

    @property
    def is_too_short(self) -> bool:
        """True if not even the longest stretch of the drive, or of its identification part, makes one batch."""
        return all(batch.duration_s < self.needed_s for batch in self.batches)

    @property
    def is_standing(self) -> bool:
        """True if a whole batch could have been driven, and apparently was, but the speed stays at 0."""
        speed, acceleration = self.streams.get(Signal.SPEED), self.streams.get(Signal.VERTICAL_ACCELERATION)
        if speed is None or acceleration is None or speed.n < 2 or self.facts.duration_s < self.needed_s:
            return False
        return speed.high < self.settings.standstill_speed_mps and acceleration.std > SHAKING_MPS2

    @property
    def is_lost(self) -> bool:
        """True if every batch was rejected."""
        return all(batch.rejected for batch in self.batches)

    def reasons(self, batches: Iterable[Batch]) -> str:
        """Why these batches were rejected, with numbers."""
        names = [str(why) for batch in batches for why in batch.rejected]
        return ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))
