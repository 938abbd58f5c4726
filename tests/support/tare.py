"""A vehicle as a tare desk sees it, without a pipeline behind it."""

from pathlib import Path
from typing import Any

from gateway.core.fusion import fused
from gateway.core.tare import Weighed
from gateway.estimate import Estimate, Quantity
from gateway.service.tare_desk import Subject, TareDesk
from gateway.units import NS_PER_S
from support.calibrated import calibration_file


class FakeFlow:
    """What the desk sees of a flow."""

    def __init__(self) -> None:
        self.tare: Any = None
        self.weighed: Weighed | None = None
        self.load_may_have_changed = False


class FakePipeline:
    """A vehicle weighed a minute ago as 12 kg and 51 %; the test may say otherwise."""

    def __init__(self) -> None:
        self.flow: Any = FakeFlow()
        self.age_s: float | None = 60.0
        self.weigh(12.0)

    def weigh(self, payload_kg: float, share_pct: float = 51.0, std_kg: float = 5.0) -> None:
        """One batch, and no other."""
        found = Estimate(
            t_start_ns=0,
            t_end_ns=300 * NS_PER_S,
            estimator="ratio_index",
            payload=Quantity(payload_kg, std_kg),
            front_share=Quantity(share_pct, 0.4),
        )
        epoch = fused(None, found)
        assert epoch is not None
        self.flow.weighed = Weighed(epoch, 0, found.t_end_ns, ("5-abc",))

    def weighed_age_s(self) -> float | None:
        return self.age_s


def tare_desk(directory: Path, pipeline: FakePipeline) -> TareDesk:
    """A desk that keeps its tares in ``directory`` and tells nobody."""
    subject = Subject(calibration_file().for_core(), "ratio_index", "van-17")
    return TareDesk(directory, subject, pipeline, stale_after_s=900.0, on_event=lambda kind, detail: None)
