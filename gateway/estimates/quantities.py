"""Every quantity in the outputs, with its name in each of them: one row per quantity.

JSON, CSV, Parquet and Prometheus take a name from ``json_name``, VSS from ``vss``, Home Assistant from ``label``. A new
quantity is a row here, a new outlet a column.
"""

from dataclasses import dataclass
from typing import Final, Literal

Unit = Literal["kg", "%", "m"]
_SUFFIX: Final[dict[Unit, str]] = {"kg": "kg", "%": "pct", "m": "m"}
_VSS_UNIT: Final[dict[Unit, str]] = {"kg": "kg", "%": "percent", "m": "m"}


@dataclass(frozen=True, slots=True)
class Outward:
    """One quantity. ``name`` is its attribute of Estimate or, where ``is_weight``, of Weights.

    ``vss`` is its path in the Vehicle Signal Specification; ``has_vss_std`` is false for a core path, which has no
    standard deviation beside it. ``label`` and ``digits`` are for Home Assistant, which shows what has a label.
    """

    name: str
    unit: Unit
    words: str
    vss: str
    is_weight: bool = False
    has_vss_std: bool = True
    label: str | None = None
    digits: int = 0

    @property
    def suffix(self) -> str:
        """The unit as a name in JSON ends in it."""
        return _SUFFIX[self.unit]

    @property
    def json_name(self) -> str:
        """The key in the JSON of an estimate: the column of CSV and Parquet."""
        return f"{self.name}_{self.suffix}"

    @property
    def json_path(self) -> str:
        """Where it stands in the JSON of an estimate, attributes joined by dots."""
        return f"weights.{self.name}.kg" if self.is_weight else self.json_name

    @property
    def vss_unit(self) -> str:
        """The unit as VSS names it."""
        return _VSS_UNIT[self.unit]


_ROW: Final = "Vehicle.Chassis.Axle.Row"

QUANTITIES: Final = (
    Outward(
        "payload",
        "kg",
        "load in addition to the empty vehicle",
        "Vehicle.Load.Payload",
        label="Payload",
    ),
    Outward(
        "front_share",
        "%",
        "share of the sprung mass on the front axle",
        "Vehicle.Load.FrontShare",
        label="Front share",
        digits=2,
    ),
    Outward("left_share", "%", "share of the sprung mass on the left wheels", "Vehicle.Load.LeftShare"),
    Outward(
        "cg_left",
        "m",
        "the sprung mass's centre of gravity, left of the centre line",
        "Vehicle.Load.CenterOfGravityLeft",
    ),
    Outward(
        "gross",
        "kg",
        "weight of the whole vehicle",
        "Vehicle.CurrentOverallWeight",
        is_weight=True,
        has_vss_std=False,
        label="Gross weight",
    ),
    *(
        Outward(
            f"{end}_axle",
            "kg",
            f"weight under the {end} axle",
            f"{_ROW}{axle}.Load",
            is_weight=True,
            label=f"{end.capitalize()} axle",
        )
        for axle, end in enumerate(("front", "rear"), 1)
    ),
    *(
        Outward(
            f"{end}_{side}",
            "kg",
            f"weight under the {end} {side} wheel",
            f"{_ROW}{axle}.Wheel.{side.capitalize()}.Load",
            is_weight=True,
        )
        for axle, end in enumerate(("front", "rear"), 1)
        for side in ("left", "right")
    ),
)
BY_NAME: Final = {one.name: one for one in QUANTITIES}
