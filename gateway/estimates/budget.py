"""The error budget: the contribution of each source, largest first, and what would narrow it.

Nothing here is canned: a remedy is offered where it applies, with the width that the same posterior would have after
it.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, SHAPE, Posterior, Source

OWN: Final = "own"  # what no other batch shares, among the sources


class Remedy(StrEnum):
    """An action that would narrow an error. gateway.estimates.reasons has the sentences."""

    DRIVE_ON = "drive_on"  # another ten minutes under the same load
    WEIGH_ONCE = "weigh_once"  # loaded, on a scale
    SAY_WHAT_IS_CARRIED = "say_what_is_carried"
    WEIGH_EMPTY = "weigh_empty"  # state that it is
    READ_ROLL_RATE = "read_roll_rate"
    WEIGH_AXLES_EMPTY = "weigh_axles_empty"  # both axles of the empty vehicle


@dataclass(frozen=True, slots=True)
class BudgetLine:
    """One source: standard deviations that it adds, NaN if the quantity is unknown. ``payload_with_remedy_kg`` is
    the standard deviation of the payload, all sources together, once the remedy is taken.
    """

    source: str
    payload_kg: float
    front_share_pct: float
    cg_left_m: float
    remedy: Remedy | None = None
    payload_with_remedy_kg: float = math.nan


def budget_of(posterior: Posterior, *, is_shape_said: bool, is_empty_weighed: bool = False) -> tuple[BudgetLine, ...]:
    """Every source that adds anything, largest payload first."""
    lines = [_line(OWN, np.sqrt(np.diag(posterior.own)), posterior)]
    lines += [_line(str(name), posterior.share_of(name), posterior) for name in posterior.sources]
    with_remedies = (_with_remedy(line, posterior, is_shape_said, is_empty_weighed) for line in lines)
    known = [line for line in with_remedies if line.payload_kg > 0.0 or line.front_share_pct > 0.0]
    return tuple(sorted(known, key=lambda line: (-line.payload_kg, line.source)))


def typical_budget(budgets: Sequence[tuple[BudgetLine, ...]]) -> tuple[BudgetLine, ...]:
    """Mean budget of several batches: root mean square by source, with the most frequent remedy."""
    rows: dict[str, list[BudgetLine]] = {}
    for line in (line for budget in budgets for line in budget):
        rows.setdefault(line.source, []).append(line)

    def rms(numbers: Iterable[float]) -> float:
        return math.sqrt(math.fsum(number**2 for number in numbers) / len(budgets))

    lines = [
        BudgetLine(
            source,
            rms(line.payload_kg for line in some),
            rms(line.front_share_pct for line in some),
            rms(line.cg_left_m for line in some),
            Counter(line.remedy for line in some).most_common(1)[0][0],
            rms(line.payload_with_remedy_kg for line in some),
        )
        for source, some in rows.items()
    ]
    return tuple(sorted(lines, key=lambda line: (-line.payload_kg, line.source)))


def _line(source: str, std: np.ndarray, posterior: Posterior) -> BudgetLine:
    front_share_pct, cg_left_m = (float(std[i]) if posterior.size > i else math.nan for i in (FRONT_SHARE, CG_LEFT))
    return BudgetLine(source, float(std[PAYLOAD]), front_share_pct, cg_left_m)


def _with_remedy(line: BudgetLine, posterior: Posterior, is_shape_said: bool, is_empty_weighed: bool) -> BudgetLine:
    for remedy in _remedies(line.source, is_shape_said, is_empty_weighed):
        return replace(line, remedy=remedy, payload_with_remedy_kg=_std_after(remedy, posterior))
    return line


def _remedies(source: str, is_shape_said: bool, is_empty_weighed: bool) -> Iterator[Remedy]:
    if source == OWN:
        yield Remedy.DRIVE_ON
    elif source in SHAPE and not is_shape_said:
        yield Remedy.SAY_WHAT_IS_CARRIED
    elif source in (Source.DAY, Source.SENSOR) and not is_empty_weighed:
        yield Remedy.WEIGH_EMPTY
    elif source == Source.CALIBRATION:
        yield Remedy.WEIGH_ONCE
    elif source == Source.SIDEWAYS:
        yield Remedy.READ_ROLL_RATE
    elif source == Source.EMPTY_SHARE:
        yield Remedy.WEIGH_AXLES_EMPTY


SAID_PART: Final = 0.5  # of the width of shapes that nobody stated: what stating them leaves


def _std_after(remedy: Remedy, posterior: Posterior) -> float:
    """Standard deviation (kg) of the payload once the remedy is taken."""
    variance = float(posterior.covariance[PAYLOAD, PAYLOAD])
    own = float(posterior.own[PAYLOAD, PAYLOAD])
    by = {name: float(posterior.share_of(name)[PAYLOAD]) ** 2 for name in Source}
    if remedy is Remedy.DRIVE_ON:
        saved = own * (2.0 / 3.0)  # three batches of five minutes in place of one
    elif remedy is Remedy.SAY_WHAT_IS_CARRIED:
        saved = (1.0 - SAID_PART**2) * sum(by[name] for name in SHAPE)
    elif remedy is Remedy.WEIGH_ONCE:
        saved = by[Source.CALIBRATION]  # at most
    elif remedy is Remedy.WEIGH_EMPTY:
        saved = by[Source.DAY] + by[Source.SENSOR]
    elif remedy is Remedy.READ_ROLL_RATE:
        saved = by[Source.SIDEWAYS]
    else:
        saved = by[Source.EMPTY_SHARE]
    return math.sqrt(max(variance - saved, 0.0))
