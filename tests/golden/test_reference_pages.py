"""The pages of files and fields say what the code does, and every example on them is one that it takes."""

import re
import shutil
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest
import reference
from pydantic import TypeAdapter
from support.half_car_road import batch_over_road, weighed

from gateway.archive.dataset import columns
from gateway.archive.manifest import ManifestFile, VehicleEntry
from gateway.bus.signals import load_signal_map
from gateway.bus.signals.signal_map import SignalEntry, SignalMapFile, shipped_maps
from gateway.calibration.campaign_file import CampaignTable, RunTable, load_campaign
from gateway.calibration.file import load_calibration
from gateway.core.vehicle import Vehicle
from gateway.estimates.as_json import FIELDS
from gateway.estimates.batch_estimate import Estimate
from gateway.records import Signal
from gateway.stated.facts import VehicleAnswers
from gateway.units import TO_SI

ROOT = Path(__file__).parents[2]
SIGNAL_MAP, CAMPAIGN, ESTIMATE, ARCHIVE = (
    (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("signal-map", "campaign", "estimate", "archive")
)


def named_in(page: str) -> list[str]:
    """Everything between backquotes."""
    return re.findall(r"`([^`\n]+)`", page)


def examples_of(page: str) -> list[str]:
    return re.findall(r"^```toml\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("table", [SignalMapFile, SignalEntry, CampaignTable, Vehicle, VehicleAnswers, RunTable])
def test_every_key_is_described(table: type) -> None:
    keys = TypeAdapter(table).json_schema()["properties"]
    assert [name for name, key in keys.items() if not key.get("description")] == []


def test_every_signal_and_every_unit_is_there() -> None:
    assert set(named_in(SIGNAL_MAP)) >= {*Signal, *(unit for units in TO_SI.values() for unit in units if unit)}
    assert set(named_in(SIGNAL_MAP)) >= {f"springscale:{name}" for name in shipped_maps()}


@pytest.mark.parametrize(
    ("page", "tables"),
    [
        (SIGNAL_MAP, (SignalMapFile, SignalEntry)),
        (CAMPAIGN, (CampaignTable, Vehicle, RunTable)),
        (ARCHIVE, (ManifestFile, VehicleEntry)),
    ],
    ids=["signal map", "campaign", "archive"],
)
def test_every_key_is_on_its_page(page: str, tables: tuple[type, ...]) -> None:
    rows = {line.split("`")[1] for line in page.splitlines() if line.startswith("| `")}
    keys = {name for table in tables for name in TypeAdapter(table).json_schema()["properties"]}
    assert keys - rows <= {"signals", "vehicle", "runs", "vehicles", "batch"}  # these are tables themselves


def test_every_column_of_a_data_set_is_on_its_page_or_a_field_of_an_estimate() -> None:
    assert set(columns()) - set(named_in(ESTIMATE)) <= set(named_in(ARCHIVE))


@pytest.mark.parametrize("example", examples_of(SIGNAL_MAP))
def test_an_example_of_a_signal_map_can_be_loaded(example: str, tmp_path: Path) -> None:
    for database in (ROOT / "dbc").glob("*.dbc"):
        shutil.copy(database, tmp_path)
    path = tmp_path / "signals.toml"
    path.write_text(example, encoding="utf-8")
    assert set(load_signal_map(path).traits) == {Signal(name) for name in tomllib.loads(example)["signals"]}


@pytest.mark.parametrize("example", examples_of(CAMPAIGN))
def test_an_example_of_a_campaign_can_be_loaded(example: str, tmp_path: Path) -> None:
    for run in tomllib.loads(example)["runs"]:
        (tmp_path / run["log"]).touch()
    path = tmp_path / "campaign.toml"
    path.write_text(example, encoding="utf-8")
    assert load_campaign(path).vehicle.name == "van"


def test_the_pages_have_examples() -> None:
    assert (len(examples_of(SIGNAL_MAP)), len(examples_of(CAMPAIGN))) == (2, 1)


def test_every_field_of_an_estimate_is_described_and_says_when_it_is_unknown() -> None:
    assert [one.name for one in FIELDS if not one.description] == []
    assert {reference.part_of(one) for one in FIELDS} == set(reference.NULL)
    nowhere_written = {"is_remainder"}  # what is no batch is no estimate either
    assert {field.name for field in fields(Estimate)} - nowhere_written <= set(reference.NULL)


def test_every_figure_of_the_default_estimator_is_explained() -> None:
    shipped = load_calibration(ROOT / "gateway" / "demo" / "paper_van.json").for_core().cross_spectrum
    assert shipped is not None
    found = weighed(batch_over_road(225.0, 50.0, seed=1), shipped)
    of_other_signals = ("noise_roll_rate_ratio", "gyro_gain_ratio", "gyro_gain_ratio_std")  # this batch has none
    told = [name for name in reference.DIAGNOSTICS if name not in of_other_signals]
    assert list(found.diagnostics) == told


def test_the_example_of_an_archive_s_manifest_is_one() -> None:
    [example] = examples_of((ROOT / "docs" / "archive.md").read_text(encoding="utf-8"))
    told = ManifestFile.model_validate(tomllib.loads(example))
    assert [(entry.name, entry.since is not None) for entry in told.vehicles] == [
        ("van-17", False),
        ("van-17", True),
        ("WF0XXXTTGXJK12346", False),
    ]
    assert not told.vehicles[0].covers(told.vehicles[1])
