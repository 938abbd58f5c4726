"""Taring: the zero corrected in the field, while the vehicle is known to be empty.

    zero = zero_of(weighed, vehicle)      # what the empty vehicle was weighed as, less what it is
    tared(estimate, tare)                 # every later estimate, less that zero; the raw numbers ride along

A tare corrects an offset, whatever its cause. It is no calibration: the scale stays as it is, and the
offset is the same at every load. Estimators and their gates see the raw numbers throughout.

Where the load lies sideways is left as it is: an empty vehicle's own place is rarely stated, and an error of the
sensor's place, which would be the cause, is no offset that stays at every load.
"""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from gateway.core.fusion import LoadEpoch
from gateway.core.vehicle import Vehicle
from gateway.errors import TareRefusedError
from gateway.estimate import Correction, Estimate, Quantity

MOST_PAYLOAD_SHARE: Final = 0.05  # of the empty sprung mass: a larger offset is a load, or asks for a calibration
MOST_FRONT_SHARE_PCT: Final = 3.0  # percentage points
MOST_STD_SHARE: Final = 0.5  # of these two bounds: a zero less sure than that corrects nothing
BATCH_IDS: Final = 20  # the newest that a weighing names; it may rest on more


class Refusal(StrEnum):
    """Why a tare is refused. docs/calibration.md tells what each asks of a person."""

    NO_CALIBRATION = "no_calibration"
    NO_COUNTED_BATCH = "no_counted_batch"
    LOAD_MAY_HAVE_CHANGED = "load_may_have_changed"
    STALE = "stale"
    OFFSET_TOO_LARGE = "offset_too_large"
    OFFSET_UNCERTAIN = "offset_uncertain"
    NOT_TARED = "not_tared"
    NOT_STORED = "not_stored"


@dataclass(frozen=True, slots=True)
class Weighed:
    """A load epoch in raw numbers, as the calibration alone has it, and the batches it rests on.

    ``drive_start_ns`` and ``t_end_ns`` are of its last counted batch; ``batch_ids`` the newest, newest last.
    """

    epoch: LoadEpoch
    drive_start_ns: int
    t_end_ns: int
    batch_ids: tuple[str, ...]

    @property
    def n_batches(self) -> int:
        """Counted batches in all."""
        return self.epoch.payload_kg.n


@dataclass(frozen=True, slots=True)
class Zero:
    """An offset with its standard deviation: payload in kg, front share in percentage points."""

    payload_kg: float
    payload_std_kg: float
    front_share_pct: float
    front_share_std_pct: float


@dataclass(frozen=True, slots=True)
class Tare:
    """A zero in use. It belongs to one calibration and one estimator; ``id`` is the hash of what was found."""

    id: str
    calibration_id: str
    estimator: str
    zero: Zero

    def is_for(self, estimate: Estimate) -> bool:
        """Whether this estimate is by the calibration and the estimator that the zero was found with."""
        return (self.calibration_id, self.estimator) == (estimate.calibration_id, estimate.estimator)


def remembered(before: Weighed | None, epoch: LoadEpoch | None, shown: Estimate, drive_start_ns: int) -> Weighed | None:
    """The weighing after one more full batch; ``shown`` is its estimate as it leaves, ``epoch`` the epoch after it.

    A batch that taught nothing changes nothing, nor does a stop: the last weighing stays until there is another.
    """
    if epoch is None or (before is not None and before.epoch is epoch):
        return before
    continues = before is not None and before.epoch.t_start_ns == epoch.t_start_ns
    earlier = before.batch_ids if before is not None and continues else ()
    return Weighed(epoch, drive_start_ns, shown.t_end_ns, (*earlier, shown.id)[-BATCH_IDS:])


def zero_of(weighed: Weighed, vehicle: Vehicle) -> Zero:
    """The zero that makes the weighed epoch an empty ``vehicle``. Raises TareRefusedError beyond the bounds.

    An empty vehicle has payload 0 and the front share its campaign stated. Standard deviations are the
    epoch's: what its batches share does not average out (core.fusion).
    """
    epoch = weighed.epoch
    zero = Zero(
        payload_kg=epoch.payload_kg.mean,
        payload_std_kg=math.sqrt(epoch.payload_kg.var),
        front_share_pct=epoch.front_share_pct.mean - vehicle.empty_front_share_pct,
        front_share_std_pct=math.sqrt(epoch.front_share_pct.var),
    )
    most_kg = MOST_PAYLOAD_SHARE * vehicle.empty_mass_kg
    _refuse_beyond(zero.payload_kg, zero.payload_std_kg, most_kg, "payload", "kg")
    _refuse_beyond(zero.front_share_pct, zero.front_share_std_pct, MOST_FRONT_SHARE_PCT, "front share", "pp")
    return zero


def _refuse_beyond(offset: float, std: float, most: float, what: str, unit: str) -> None:
    if not abs(offset) <= most:
        raise TareRefusedError(
            Refusal.OFFSET_TOO_LARGE,
            f"the {what} is {offset:+.1f} {unit} off, a tare corrects up to {most:.1f} {unit}: "
            "either the vehicle is not empty, or it needs a calibration",
        )
    if not std <= MOST_STD_SHARE * most:
        raise TareRefusedError(
            Refusal.OFFSET_UNCERTAIN,
            f"the {what} is known to {std:.1f} {unit} only, a tare needs {MOST_STD_SHARE * most:.1f} {unit}: "
            "drive on, empty, for another batch",
        )


def tared(estimate: Estimate, tare: Tare | None) -> Estimate:
    """``estimate`` less the zero, its standard deviations widened by the zero's own in quadrature.

    What was raw rides along in ``Estimate.tare``. Rejections, and estimates that the tare is not for,
    stay as they are. Intervals keep their shape: each half of one widens in quadrature by the zero's 1.96 std.
    """
    if tare is None or not estimate.counted or not tare.is_for(estimate):
        return estimate
    payload = Quantity(tare.zero.payload_kg, tare.zero.payload_std_kg)
    front_share = Quantity(tare.zero.front_share_pct, tare.zero.front_share_std_pct)
    e, epoch = estimate, estimate.epoch
    return replace(
        e,
        payload=_less(e.payload, payload),
        front_share=_less(e.front_share, front_share),
        correlation=e.correlation * _kept(e.payload, payload) * _kept(e.front_share, front_share),
        payload_cg_left_correlation=e.payload_cg_left_correlation * _kept(e.payload, payload),
        front_share_cg_left_correlation=e.front_share_cg_left_correlation * _kept(e.front_share, front_share),
        epoch=epoch
        and replace(epoch, payload=_less(epoch.payload, payload), front_share=_less(epoch.front_share, front_share)),
        tare=Correction(tare.id, payload, front_share, raw_payload=e.payload, raw_front_share=e.front_share),
    )


def _kept(raw: Quantity, zero: Quantity) -> float:
    """By how much the zero's own error, which knows nothing of the other quantity, lessens a correlation."""
    return raw.std / math.hypot(raw.std, zero.std)


def _less(raw: Quantity, zero: Quantity) -> Quantity:
    """``raw`` less ``zero``; NaN stays NaN."""
    low, high = raw.interval95
    moved = Quantity(raw.number - zero.number, raw.std, (low - zero.number, high - zero.number))
    return moved.widened(zero.std)
