"""The locks agree, and a vehicle's is small."""

import tomllib

import pytest
from make_deb import UNIMPORTED, of_desk
from support.locks import ROOT, pins

VEHICLE = pins("requirements.txt")
FOR_DESKS = ("matplotlib", "numba", "llvmlite", "pillow")
UNUSED = ("watchfiles", "websockets")


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
    assert set(FOR_DESKS) <= of_desk()
    assert of_desk() & VEHICLE.keys() == UNIMPORTED == {"narwhals", "plotly"}
