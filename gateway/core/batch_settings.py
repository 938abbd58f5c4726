"""How batches are formed and gated. The defaults are the service's; config.py describes them to users."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BatchSettings:
    """Window, gates and tolerances of the batch scheduler."""

    window_s: float = 300.0
    rate_hz: float = 50.0
    speed_min_mps: float = 5.0
    speed_max_mps: float = 40.0
    usable_share_min: float = 0.6
    gap_share_max: float = 0.2
    last_batch_share_min: float = 0.95
    standstill_s: float = 60.0
    standstill_speed_mps: float = 0.5
    silence_s: float = 10.0
    clock_step_s: float = 1.0
    gap_s: float = 0.05
    speed_hold_s: float = 3.0
    stuck_s: float = 5.0
    speed_frozen_s: float = 60.0
    provisional_every_s: float = 0.0
    position_decimals: int | None = None  # of a degree; None keeps no position
