"""Tables of springscale.toml about who must know: when an alarm is told, and where to."""

from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from gateway.config.sections import Section
from gateway.core.alarms import CAUSE_NAMES, AlarmRules


def _of_a_cause(name: str) -> str:
    if name not in CAUSE_NAMES:
        raise ValueError(f"is no alarm; there are {', '.join(CAUSE_NAMES)}")
    return name


CauseName = Annotated[str, AfterValidator(_of_a_cause)]


class AlarmsSection(Section):
    """When an alarm is told, confirmed and ended. Permitted weights are those of the vehicle."""

    off: tuple[CauseName, ...] = Field(
        (), description='alarms that are not wanted, by name or by kind: `["drift", "overload.front_left"]`'
    )
    early_probability: float = Field(
        0.9, gt=0.5, lt=1.0, description="one batch warns where it is so probable that a limit is passed"
    )
    final_probability: float = Field(
        0.95, gt=0.5, lt=1.0, description="the batches of one load confirm it where they together make it so probable"
    )
    final_batches: int = Field(2, ge=2, le=20, description="how many batches of one load it takes at least")
    clear_probability: float = Field(
        0.25, gt=0.0, le=0.5, description="the alarm ends where the load makes it no more probable than this"
    )
    side_share_max_pct: float = Field(
        55.0, ge=50.0, le=100.0, description="of the sprung mass, on the wheels of one side (needs a roll rate)"
    )
    axle_share_max_pct: float = Field(75.0, ge=50.0, le=100.0, description="of the sprung mass, on one axle")
    sensor_silent_s: float = Field(
        60.0, ge=10.0, le=86_400.0, description="a needed sensor silent for so long on a bus that is alive is told"
    )
    sensor_silent_final_s: float = Field(600.0, ge=10.0, le=86_400.0, description="likewise, for sure")
    no_estimate_min: float = Field(
        120.0,
        ge=5.0,
        le=10_000.0,
        description="minutes driven without an estimate before that is told; twice: for sure",
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.sensor_silent_final_s < self.sensor_silent_s:
            raise ValueError("sensor_silent_final_s must not be below sensor_silent_s")
        return self

    def for_core(self) -> AlarmRules:
        """The same settings for the core."""
        chosen = self.model_dump(exclude={"no_estimate_min"})
        return AlarmRules(**chosen, no_estimate_s=60.0 * self.no_estimate_min)
