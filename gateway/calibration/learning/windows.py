"""Drives as windows that can teach, and their pieces between the moments at which a statement begins or ends."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from gateway.calibration.assigned import Piece
from gateway.calibration.inspection.facts import RowFacts, joined_facts
from gateway.calibration.kept import KeptBatch
from gateway.calibration.learning.spans import ENOUGH_S, can_teach, spans_of, teaching_most
from gateway.core.batch_settings import BatchSettings
from gateway.core.pool import LEAST_LOAD_S, Part, spanned
from gateway.estimates.batch_estimate import Way
from gateway.records import Batch, Why, date_of
from gateway.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class Driven:
    """A piece of a drive that can teach: its windows, and the facts of the rows of the windows that it lies in.

    ``source`` says where it was read, for people: a log, or nothing.
    """

    piece: Piece
    batches: tuple[Batch, ...]
    facts: RowFacts
    source: str = ""

    @property
    def name(self) -> str:
        """Its begin, which is its name in files."""
        date = date_of(self.piece.begin_ns)
        return f"{date[:19]}Z" if date else f"no date, {self.piece.begin_ns / NS_PER_S:.0f} s"

    @property
    def usable_s(self) -> float:
        """Driving in its windows."""
        return sum(batch.usable_s for batch in self.batches)

    @property
    def sha256(self) -> str:
        """Of its samples: the same drive is the same whatever log or service it was read by."""
        digest = hashlib.sha256()
        for batch in self.batches:
            columns = [batch.vertical_acceleration_mps2, batch.pitch_rate_radps, batch.speed_mps, batch.usable]
            columns += [] if batch.roll_rate_radps is None else [batch.roll_rate_radps]
            digest.update(f"{batch.t_start_ns} {batch.t_end_ns} {batch.rate_hz}".encode())
            for column in columns:
                digest.update(column.tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class Pieces:
    """The pieces that can teach, in order of time, and how many cannot for want of driving."""

    driven: tuple[Driven, ...]
    n_short: int = 0
    short_s: float = 0.0


def pieces(
    windows: Iterable[KeptBatch],
    at_ns: Sequence[int],
    settings: BatchSettings,
    source: Callable[[KeptBatch], str] = lambda window: "",
) -> Pieces:
    """The windows of drives, each drive cut at the moments ``at_ns``. What cannot teach is left out and counted."""
    every = sorted(windows, key=lambda one: (one.batch.drive_start_ns, one.batch.t_start_ns))
    ordered = list(_begins([one for one in every if can_teach(one.batch, settings)]))
    starts = list(dict.fromkeys(one.batch.drive_start_ns for one in ordered))
    short = [one for one in every if one.batch.drive_start_ns not in starts]
    n_short = len({one.batch.drive_start_ns for one in short})
    short_s = sum(one.batch.usable_s for one in short)
    driven: list[Driven] = []
    for piece in spans_of([_span(one.batch) for one in ordered], at_ns):
        mine = [
            one
            for one in ordered
            if one.batch.drive_start_ns == starts[piece.drive - 1] and piece.meets(*_span(one.batch)[1:])
        ]
        cuts = [(one, batch) for one in mine if (batch := _within(one.batch, piece)) is not None]
        if taught := [(one, batch) for one, batch in cuts if not batch.rejected]:
            facts = joined_facts([one.facts for one, _ in taught])
            batches = tuple(batch for _, batch in taught)
            driven.append(Driven(piece, batches, facts, source(taught[0][0])))
        else:
            n_short += 1
            short_s += sum(batch.usable_s for _, batch in cuts)
    return Pieces(tuple(sorted(driven, key=lambda one: one.piece.begin_ns)), n_short, short_s)


def _begins(windows: Sequence[KeptBatch]) -> Iterator[KeptBatch]:
    """Of each drive the windows that it begins with, up to as much driving as is learnt from."""
    for _, group in groupby(windows, lambda one: one.batch.drive_start_ns):
        driven_s = 0.0
        for one in group:
            if driven_s < ENOUGH_S:
                yield one
            driven_s += one.batch.usable_s


def _span(batch: Batch) -> tuple[int, int, int]:
    return batch.drive_start_ns, batch.t_start_ns, batch.t_end_ns


def _within(window: Batch, piece: Piece) -> Batch | None:
    """The part of a window that lies in a piece, rejected if it is too short to teach; None without a sample."""
    if piece.begin_ns <= window.t_start_ns and window.t_end_ns <= piece.end_ns:
        return replace(window, rejected=())
    try:
        part = spanned((Part(window, Way()),), piece.begin_ns, piece.end_ns)
    except IndexError:  # less than one sample
        return None
    return part if part.usable_s >= LEAST_LOAD_S else replace(part, rejected=(Why.TOO_SHORT,))


def chosen(driven: Sequence[Driven], is_stated: Sequence[bool]) -> list[int]:
    """The pieces that teach most, in order of time."""
    return teaching_most([(one.usable_s, one.piece.end_ns, said) for one, said in zip(driven, is_stated, strict=True)])
