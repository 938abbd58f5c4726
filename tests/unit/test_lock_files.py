"""The locks agree, a vehicle's is small, and what the wheel carries of others' is what they published."""

import hashlib
import json
import tomllib

import pytest
from make_deb import DESK_LOCK, VEHICLE_LOCK, pinned
from support.locks import ROOT, pins

from gateway.web.charting import VENDORED

VEHICLE = pins("requirements.txt")
FOR_DESKS = ("matplotlib", "numba", "plotly", "llvmlite", "pillow", "narwhals")
UNUSED = ("fastapi-offline", "watchfiles", "websockets")


@pytest.mark.parametrize("name", [*FOR_DESKS, *UNUSED])
def test_a_vehicle_does_without(name: str) -> None:
    assert name not in VEHICLE


def test_what_the_service_loads_by_name_is_locked() -> None:
    assert {"httptools", "uvloop"} <= VEHICLE.keys()


def test_the_workbench_has_all_of_a_vehicle_and_the_extra_at_the_same_versions() -> None:
    desk = pins("requirements-workbench.txt")
    assert desk.items() > VEHICLE.items()
    extra = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["workbench"]
    assert {requirement.partition(">=")[0] for requirement in extra} <= desk.keys() - VEHICLE.keys()


@pytest.mark.parametrize("name", ["requirements-build.txt", "requirements-dev.txt"])
def test_no_lock_contradicts_another(name: str) -> None:
    others = {**pins("requirements-workbench.txt"), **pins("requirements-build.txt")}
    both = pins(name).items() & others.items()
    assert {package for package, _ in both} == pins(name).keys() & others.keys()


def test_the_debian_packages_part_along_the_locks() -> None:
    of_desk = pinned(DESK_LOCK) - pinned(VEHICLE_LOCK)
    assert set(FOR_DESKS) <= of_desk
    assert of_desk.isdisjoint(VEHICLE)


@pytest.mark.parametrize("name", ["plotly", "swagger-ui"])
def test_vendored_files_are_those_that_were_published(name: str) -> None:
    (each,) = [each for each in json.loads((VENDORED / "vendored.json").read_text()) if each["folder"] == name]
    there = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in (VENDORED / name).iterdir()}
    assert there == each["sha256"]
    assert "LICENSE.txt" in there
