"""Spectra of all identification batches in one table, in an order that does not depend on the campaign's."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.core.ratio_index.index import SpectrumKind, mean_spectrum
from gateway.core.spectrum import segment_starts
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, I64, Batch, Bool


@dataclass(frozen=True, slots=True)
class IndexTable:
    """Spectra of all identification batches with what is known of each.

    run (n,) tells drives apart, 0 for the first in the table; number (n,) is the campaign's and t_start_ns (n,)
    the batch's own; payload_kg, front_share_pct (n,); freq_hz (m,);
    acceleration and pitch_rate (n, m), absent (None) where the sensor is not mapped; n_segments (n,)
    averaged in each.
    """

    run: I64
    number: I64
    t_start_ns: I64
    payload_kg: F64
    front_share_pct: F64
    freq_hz: F64
    acceleration: F64 | None
    pitch_rate: F64 | None
    n_segments: F64
    kind: SpectrumKind
    n_segment: int

    @property
    def n_runs(self) -> int:
        """Different drives in the table."""
        return len(np.unique(self.run))

    @property
    def n_loads(self) -> int:
        """Different payloads."""
        return len(np.unique(self.payload_kg))

    @property
    def n_shares(self) -> int:
        """Different front shares, to a hundredth of a percentage point."""
        return len(np.unique(self.front_share_pct.round(2)))

    def rows(self, chosen: Bool) -> "IndexTable":
        """The chosen batches only; chosen (n,)."""
        return replace(
            self,
            run=self.run[chosen],
            number=self.number[chosen],
            t_start_ns=self.t_start_ns[chosen],
            payload_kg=self.payload_kg[chosen],
            front_share_pct=self.front_share_pct[chosen],
            acceleration=None if self.acceleration is None else self.acceleration[chosen],
            pitch_rate=None if self.pitch_rate is None else self.pitch_rate[chosen],
            n_segments=self.n_segments[chosen],
        )


def index_table(runs: Sequence[KnownRun], kind: SpectrumKind, n_segment: int) -> IndexTable:
    """Every counted batch of which both mapped sensors give a spectrum; runs sorted by name, then by time.

    Raises CalibrationImpossibleError where there is none.
    """
    batches = [(run, batch) for run in runs for batch in run.batches if not batch.rejected]
    batches.sort(key=lambda one: (one[0].name, one[1].t_start_ns, one[0].payload_kg, one[0].number))
    rows = [(run, batch, *_spectra(batch, kind, n_segment)) for run, batch in batches]
    has_a = any(a is not None for _, _, a, _ in rows)
    has_g = any(g is not None for _, _, _, g in rows)
    whole = [row for row in rows if (row[2] is not None or not has_a) and (row[3] is not None or not has_g)]
    if not whole or not (has_a or has_g):
        raise CalibrationImpossibleError("no identification batch has enough unbroken driving for a spectrum")
    place = {number: i for i, number in enumerate(dict.fromkeys(run.number for run, _, _, _ in whole))}
    freq_hz = next(spectrum[0] for _, _, a, g in whole for spectrum in (a, g) if spectrum is not None)
    return IndexTable(
        run=np.array([place[run.number] for run, _, _, _ in whole]),
        number=np.array([run.number for run, _, _, _ in whole]),
        t_start_ns=np.array([batch.t_start_ns for _, batch, _, _ in whole]),
        payload_kg=np.array([run.payload_kg for run, _, _, _ in whole]),
        front_share_pct=np.array([run.front_share_pct for run, _, _, _ in whole]),
        freq_hz=freq_hz,
        acceleration=np.array([a[1] for _, _, a, _ in whole if a is not None]) if has_a else None,
        pitch_rate=np.array([g[1] for _, _, _, g in whole if g is not None]) if has_g else None,
        n_segments=np.array([_n_segments(batch, n_segment) for _, batch, _, _ in whole]),
        kind=kind,
        n_segment=n_segment,
    )


def _spectra(batch: Batch, kind: SpectrumKind, n_segment: int) -> tuple[tuple[F64, F64] | None, tuple[F64, F64] | None]:
    a, g = (
        mean_spectrum(x, batch.usable, n_segment, batch.rate_hz, kind)
        for x in (batch.vertical_acceleration_mps2, batch.pitch_rate_radps)
    )
    return a, g


def _n_segments(batch: Batch, n_segment: int) -> float:
    """The fewer of the two sensors' segments, a silent one left out."""
    counts = [
        len(segment_starts(batch.usable & np.isfinite(x), n_segment, n_segment // 2))
        for x in (batch.vertical_acceleration_mps2, batch.pitch_rate_radps)
    ]
    return float(min(count for count in counts if count > 0))
