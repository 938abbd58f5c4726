"""Spectra of all identification batches in one table, in an order independent of the campaign's."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.stated_drive import StatedDrive
from gateway.core.ratio_index.index import (
    RatioIndexCalibration,
    acceleration_segments,
    acceleration_spectrum,
    indexes_of,
    is_moved,
    mean_spectrum,
)
from gateway.core.spectrum import segment_starts
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, I64, Batch, Bool

N_SEGMENT: Final = 1024  # 20.5 s at 50 Hz: resolves 0.05 Hz and still fits between two traffic lights


@dataclass(frozen=True, slots=True)
class SpectrumTable:
    """Spectra of identification batches with their true loads. Pairs: acceleration and payload, pitch rate and share.

    run (n,) is the drive, 0 for the first in the table, number (n,) the campaign's number; targets (n,) in kg and
    percent; spectra (n, m) at freq_hz (m,), None if the sensor is not mapped; n_segments (n,) averaged in each. The
    acceleration's are moved to the centre line from roll_lever_m left of it; 0: as measured.
    """

    run: I64
    number: I64
    targets: tuple[F64, F64]
    freq_hz: F64
    spectra: tuple[F64 | None, F64 | None]
    n_segments: F64
    roll_lever_m: float = 0.0

    @property
    def n_runs(self) -> int:
        """Different drives in the table."""
        return len(np.unique(self.run))

    @property
    def n_loads(self) -> int:
        """Different payloads."""
        return len(np.unique(self.targets[0]))

    @property
    def n_shares(self) -> int:
        """Different front shares, to a hundredth of a percentage point."""
        return len(np.unique(self.targets[1].round(2)))

    def rows(self, chosen: Bool) -> "SpectrumTable":
        """The table with the chosen (n,) batches only."""
        (payload_kg, share_pct), (of_a, of_g) = self.targets, self.spectra
        return replace(
            self,
            run=self.run[chosen],
            number=self.number[chosen],
            targets=(payload_kg[chosen], share_pct[chosen]),
            spectra=(None if of_a is None else of_a[chosen], None if of_g is None else of_g[chosen]),
            n_segments=self.n_segments[chosen],
        )


def spectrum_table(runs: Sequence[StatedDrive], sensor_offset_left_m: float = 0.0) -> SpectrumTable:
    """Every counted batch with a spectrum of each mapped sensor; runs sorted by name, then by time.

    With a roll rate in every batch the acceleration is that of the centre line, sensor_offset_left_m to the right of
    the sensor; else all are taken as measured. Raises CalibrationImpossibleError without any spectrum.
    """
    batches = [(run, batch) for run in runs for batch in run.batches if not batch.rejected]
    batches.sort(key=lambda one: (one[0].log, one[1].t_start_ns, one[0].payload_kg, one[0].number))
    rows = [(run, batch, *_spectra(batch, 0.0)) for run, batch in batches]
    heard = [batch for _, batch, a, _ in rows if a is not None]
    roll_lever_m = 0.0
    if heard and all(is_moved(batch, N_SEGMENT, sensor_offset_left_m) for batch in heard):
        roll_lever_m = sensor_offset_left_m
        rows = [(run, batch, *_spectra(batch, roll_lever_m)) for run, batch in batches]
    has_a = any(a is not None for _, _, a, _ in rows)
    has_g = any(g is not None for _, _, _, g in rows)
    whole = [row for row in rows if (row[2] is not None or not has_a) and (row[3] is not None or not has_g)]
    if not whole or not (has_a or has_g):
        raise CalibrationImpossibleError("no identification batch has enough unbroken driving for a spectrum")
    numbers = [run.number for run, _, _, _ in whole]
    place = {number: i for i, number in enumerate(dict.fromkeys(numbers))}
    return SpectrumTable(
        run=np.array([place[number] for number in numbers]),
        number=np.array(numbers),
        targets=(
            np.array([run.payload_kg for run, _, _, _ in whole]),
            np.array([run.front_share_pct for run, _, _, _ in whole]),
        ),
        freq_hz=next(one[0] for one in whole[0][2:] if one is not None),
        spectra=(
            np.array([a[1] for _, _, a, _ in whole if a is not None]) if has_a else None,
            np.array([g[1] for _, _, _, g in whole if g is not None]) if has_g else None,
        ),
        n_segments=np.array([_n_segments(batch, roll_lever_m) for _, batch, _, _ in whole]),
        roll_lever_m=roll_lever_m,
    )


def _spectra(batch: Batch, roll_lever_m: float) -> tuple[tuple[F64, F64] | None, tuple[F64, F64] | None]:
    return (
        acceleration_spectrum(batch, N_SEGMENT, roll_lever_m),
        mean_spectrum(batch.pitch_rate_radps, batch.usable, N_SEGMENT, batch.rate_hz),
    )


def _n_segments(batch: Batch, roll_lever_m: float) -> float:
    """The smaller number of segments of both sensors, without a silent one."""
    of_a = acceleration_segments(batch, N_SEGMENT, roll_lever_m)
    of_g = segment_starts(batch.usable & np.isfinite(batch.pitch_rate_radps), N_SEGMENT, N_SEGMENT // 2)
    return float(min(len(starts) for starts in (of_a, of_g) if len(starts)))


@dataclass(frozen=True, slots=True)
class IndexRows:
    """Run number, payload, front share, R_a and R_g (n,) of every batch with the calibrated indexes."""

    run: I64
    payload_kg: F64
    front_share_pct: F64
    ra: F64
    rg: F64


def index_rows(runs: Sequence[StatedDrive], calibration: RatioIndexCalibration) -> IndexRows:
    """The ratio indexes of all sound batches of ``runs``; an index whose bands are not calibrated is NaN."""
    wanted = [calibration.acceleration_bands is not None, calibration.pitch_rate_bands is not None]
    rows = [
        (run.number, run.payload_kg, run.front_share_pct, *indexes_of(batch, calibration))
        for run in runs
        for batch in run.batches
        if not batch.rejected
    ]
    kept = np.array([row for row in rows if np.all(np.isfinite(row[3:])[wanted])], dtype=float).reshape(-1, 5)
    return IndexRows(kept[:, 0].astype(np.int64), *kept[:, 1:].T)
