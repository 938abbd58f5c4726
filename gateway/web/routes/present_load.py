"""The present load: its weights, and the verdict on it, for the cab page and the dashboard alike."""

from dataclasses import dataclass
from typing import Final

from pydantic import BaseModel, Field

from gateway.core.alarms.alarm import AlarmKind
from gateway.core.alarms.rules import as_of_load
from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import Light
from gateway.core.weights.on_the_road import NOT_CALIBRATED, PayloadPlace, place_of, weighed
from gateway.core.weights.verdict import Says, Verdict, verdict_of
from gateway.estimates.batch_estimate import Estimate, Weights
from gateway.estimates.quantity import half_width
from gateway.estimates.reasons import EXPLANATIONS, Cause
from gateway.records import Why, rounded
from gateway.status import Status
from gateway.web.live.board import Board
from gateway.weighing.calibrated import CalibratedVehicle

_DOUBTING: Final = {Cause.SENSORS, Cause.ANSWER}  # roads and driving say nothing against an earlier weight


class VerdictTold(BaseModel):
    """One light and one sentence, the same on every page."""

    light: Light = Field(
        description="near: a limit lies within the 95 % interval; over: too much is more probable than not; unknown: "
        "no limit or no weight is known, it is doubted, or not exact enough to be of use"
    )
    says: Says = Field(
        description="the sentence beside it; was_over: an overload alarm is active, and the first value since "
        "is below the limit; vague: no limit is near, but the payload's ± is above `useful_at_kg` of /api/v1/learning; "
        "ready: calibrated, the first weight comes after the next `window_s` of driving"
    )
    light_about: list[str] = Field(description="places both are about, the worst first", examples=[["rear_axle"]])
    over_limit_probability: float | None = Field(description="of the worst place, 0 to 1", examples=[0.02])


@dataclass(frozen=True, slots=True)
class PresentLoad:
    """The present load by all its batches, its weights and the verdict; ``rejected`` is of the last whole batch."""

    load: Estimate | None
    weights: Weights
    rejected: tuple[Why, ...]
    verdict: Verdict

    @property
    def is_vague(self) -> bool:
        """Whether the weights are not exact enough to say what may still be loaded."""
        return self.verdict.says is Says.VAGUE

    @property
    def is_doubted(self) -> bool:
        """Whether the weights may no longer be valid."""
        return self.verdict.says is Says.DOUBTED

    def told(self) -> VerdictTold:
        """The verdict as it is sent."""
        found = self.verdict
        return VerdictTold(
            light=found.light,
            says=found.says,
            light_about=list(found.about),
            over_limit_probability=rounded(found.over_limit_probability, 4),
        )


NOT_WEIGHED: Final = Estimate(0, 0, "")


class Scales:
    """Weights of estimates by the vehicle's present figures, not by those an estimate was stored with."""

    def __init__(self, calibrated: CalibratedVehicle | None) -> None:
        self.vehicle: Vehicle | None = None if calibrated is None else calibrated.vehicle
        self._unsprung = NOT_CALIBRATED if calibrated is None else calibrated.unsprung

    def weigh(self, estimate: Estimate | None) -> Weights:
        """Unknown if the vehicle's figures are; None: nothing was weighed yet."""
        return weighed(estimate or NOT_WEIGHED, self.vehicle, self._unsprung).weights

    def place(self, estimate: Estimate | None) -> PayloadPlace | None:
        """The position of its payload; None if unknown."""
        if self.vehicle is None or estimate is None or estimate.posterior is None:
            return None
        return place_of(self.vehicle, estimate.posterior)

    def present_load(self, board: Board, now: Status) -> PresentLoad:
        """The present load as far as it is known."""
        shown = board.shown().estimate
        load = None if shown is None else as_of_load(shown)
        weights, rejected = self.weigh(load), _rejected(board.heard(), shown, now)
        alarms = [name.partition(".") for name in now.alarms.active]
        verdict = verdict_of(
            weights,
            is_calibrated=now.calibration_id is not None,
            is_weighed=load is not None,
            is_doubted=any(EXPLANATIONS[why].cause in _DOUBTING for why in rejected),
            is_vague=self._is_vague(load),
            alarmed=tuple(where for kind, _, where in alarms if kind == AlarmKind.OVERLOAD),
        )
        return PresentLoad(load, weights, rejected, verdict)

    def _is_vague(self, load: Estimate | None) -> bool:
        """Whether the payload's 95 % interval is wider than one that is of use."""
        if load is None or self.vehicle is None:
            return False
        return half_width(load.payload.interval95) > self.vehicle.useful_half_width_kg


def _rejected(heard: Estimate | None, shown: Estimate | None, now: Status) -> tuple[Why, ...]:
    """Why the last whole batch was refused, if none was weighed since. A provisional estimate does not replace a
    refused batch; a calibration that came since does.
    """
    if heard is None:
        return ()
    is_weighed_since = shown is not None and not shown.is_provisional and shown.t_end_ns >= heard.t_end_ns
    if is_weighed_since or (now.calibration_id is not None and Why.NO_CALIBRATION in heard.rejected):
        return ()
    return heard.rejected
