"""docs/line.md states by how much vehicles differ as the code has it."""

import re
from pathlib import Path

import pytest

from gateway.calibration.line.scatter import SCATTER_STD

PAGE = (Path(__file__).parents[2] / "docs" / "line.md").read_text(encoding="utf-8")
ROWS = {
    "springs": ("spring_front_npm", "spring_rear_npm"),
    "slope, each bend of the springs": ("spring_slope_rear_per_kn", "spring_bend_front_0_per_kn"),
    "dampers": ("damper_front_nspm", "damper_rear_nspm"),
    "mounts of the dampers": ("damper_mount_front_npm",),
    "tyres": ("tyre_front_npm", "tyre_rear_npm"),
    "friction shares": ("damper_friction_front", "spring_friction_rear"),
    "unsprung masses": ("unsprung_front_kg", "unsprung_rear_kg"),
    "pitch and roll inertia": ("pitch_inertia_kgm2", "roll_inertia_kgm2"),
    "additional delay of the rear axle": ("rear_lag_s",),
    "anti-roll bars, dampers against roll": ("anti_roll_front_npm", "anti_roll_rear_npm", "damper_against_front"),
    "the payload's gyration, the floor's damping": (
        "payload_gyration_m2", "payload_roll_gyration_m2", "payload_damping_ratio",
    ),
    "frequency of the floor": ("payload_mode_hz",),
    "the roads' tracks and twist": ("tracks_apart_m", "twist_level"),
}  # fmt: skip


@pytest.mark.parametrize("row", ROWS)
def test_the_table_says_what_the_code_has(row: str) -> None:
    cells = next(line.split("|") for line in PAGE.splitlines() if line.startswith(f"| {row} |"))
    for name in ROWS[row]:
        std = SCATTER_STD[name]
        assert any(said in cells[2] for said in (f"{100.0 * std:g} %", f"{std:g} ", f"{1000.0 * std:g} ms")), name


def test_every_inherited_parameter_stands_in_a_row() -> None:
    told = {_stem(name) for names in ROWS.values() for name in names}
    assert told == {_stem(name) for name in SCATTER_STD}


def _stem(name: str) -> str:
    """Whichever end and bend it is of."""
    return re.sub("_front|_rear|_[0-9]", "", name)
