"""The information of the data about each parameter of the half-car and of roll."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.half_car import Inherited, prior_of
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import ROLL_PARAMETERS, has_roll, is_positive, names_of
from gateway.core.vehicle import Vehicle
from gateway.reports.charts import Axis, Chart, Panel, Points, Rule, Table

UNTOLD_SHARE: Final = (
    0.9  # chosen: of the prior's standard deviation; with more remaining the data had little information
)


@dataclass(frozen=True, slots=True)
class Known:
    """One parameter before and after: in its unit, and the remaining share of the prior's standard deviation."""

    name: str
    prior: float
    posterior: float
    spread: str
    left_over: float
    is_slack: bool


def knowledge_of(
    calibration: CrossSpectrumCalibration, vehicle: Vehicle, inherited: Inherited | None = None
) -> list[Known]:
    """The posterior of each parameter against its prior, or against the ``inherited`` one, in the order of the
    parameters.
    """
    theta = calibration.parameters
    prior = (inherited.prior_of if inherited else prior_of)(vehicle, with_roll=has_roll(theta))
    stds, before_stds = np.sqrt(np.diag(calibration.covariance)), prior.std
    known = []
    for i, name in enumerate(names_of(theta)):
        before, after, std = float(prior.mean[i]), float(theta[i]), float(stds[i])
        if is_positive(name):
            before, after, spread = float(np.exp(before)), float(np.exp(after)), f"{100.0 * std:.1f} %"
        else:
            spread = f"{std:.3g}"
        known.append(Known(name, before, after, spread, std / float(before_stds[i]), name.startswith("slack_")))
    return known


def told(known: Sequence[Known], beforehand: str = "vehicles usually have") -> str:
    """The parameters with little information in the data, which stay as known ``beforehand``, in words."""
    untold = [one.name for one in known if one.left_over > UNTOLD_SHARE and not one.is_slack]
    if not untold:
        return "The data told something of every parameter of the vehicle."
    return (
        f"What the data could not tell ({len(untold)} of {sum(not one.is_slack for one in known)} parameters keep more "
        f"than {100.0 * UNTOLD_SHARE:.0f} % of their prior's spread): {', '.join(untold)}. These stay at what "
        f"{beforehand}; loads that depend on them are weighed with that uncertainty."
    )


def knowledge_chart(known: Sequence[Known]) -> Chart:
    """Remaining standard deviations, parameter by parameter."""
    plain = [one for one in known if not one.is_slack and "_bend_" not in one.name]
    groups = (
        ("vehicle", [one for one in plain if one.name not in ROLL_PARAMETERS]),
        ("roll", [one for one in plain if one.name in ROLL_PARAMETERS]),
        ("bends of spring rates", [one for one in known if "_bend_" in one.name]),
        ("slack", [one for one in known if one.is_slack]),
    )
    panels = tuple(_panel(title, members) for title, members in groups if members)
    return Chart(
        "identifiability",
        "Standard deviation of every parameter after calibration, in percent of what it was before. Left: the data "
        "told it; at 100 % they said nothing and the prior stands. Slack: power of a "
        "sensor (acceleration a, pitch rate g, roll rate r) that does not come through the modelled path.",
        "Identifiability: share of the prior standard deviation left over after calibration, parameter by parameter.",
        panels,
        most_columns=2 if len(panels) == 4 else 3,
        row_height_px=560,
    )


def _panel(title: str, members: Sequence[Known]) -> Panel:
    left_over = 100.0 * np.array([one.left_over for one in members])[::-1]
    places = tuple(_short(one.name) for one in members)[::-1]
    marks = (Rule(100.0, is_vertical=True), Points(left_over, np.arange(len(members), dtype=float), notes=places))
    return Panel(Axis("left over [%]", limits=(0.0, 105.0)), Axis("", places=places), marks, title)


def _short(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    plain = (stem if unit in _UNITS else name).replace("spring_bend_", "").replace("_per", "").replace("slack_", "")
    for sensor, letter in (("acceleration_", "a "), ("pitch_rate_", "g "), ("roll_rate_", "r ")):
        plain = plain.replace(sensor, letter)
    return plain.replace("_", " ")


_UNITS: Final = {"npm", "nspm", "kg", "kgm2", "m2", "m", "kn", "s", "rad"}


def knowledge_table(known: Sequence[Known]) -> Table:
    """Every parameter of the vehicle before and after."""
    rows = tuple(
        (one.name, f"{one.prior:.4g}", f"{one.posterior:.4g}", one.spread, f"{100.0 * one.left_over:.0f} %")
        for one in known
        if not one.is_slack
    )
    columns = ("Parameter", "before", "after", "standard deviation", "of the prior's")
    return Table("Parameters of the vehicle, in the unit that ends their name", columns, rows)
