"""Files that people give: each is read, or refused with one clear line, in time proportional to its size."""

import re
from pathlib import Path

import pytest
from support.commands import called
from support.configured import service_config

from gateway.bus.signals import load_signal_map
from gateway.config import VEHICLE_ID
from gateway.errors import ConfigurationError, SignalMapError
from gateway.files.toml_file import read_toml

HUGE = "9" * 400
MAP = 'dbc = ["a.dbc"]\n[signals.vertical_acceleration]\nmessage = "IMU"\nsignal = "A"\n'
DBC = """VERSION ""
NS_ :
BS_:
BU_: X
BO_ 304 IMU: 8 X
 SG_ A : 7|16@0- (0.1,0) [-{HUGE}|{HUGE}] "m/s^2" X
 SG_ P : 23|16@0- (0.001,0) [0|0] "rad/s" X
"""


def written(folder: Path, of_map: str = "") -> Path:
    (folder / "a.dbc").write_text(DBC.replace("{HUGE}", HUGE))
    (folder / "map.toml").write_text(MAP + of_map)
    return folder / "map.toml"


def test_a_range_that_no_float_holds_counts_as_none(tmp_path: Path) -> None:
    (mapped,) = load_signal_map(written(tmp_path)).messages[0].signals
    assert (mapped.minimum, mapped.maximum) == pytest.approx((-3276.8, 3276.7))


@pytest.mark.parametrize(
    "more",
    [f"minimum = -{HUGE}", f"maximum = {HUGE}", f"latency_s = {HUGE}", f"sign = {HUGE}", f"valid_when = {{P = {HUGE}}}",
     f"valid_when = {{P = [1, {HUGE}]}}", "valid_when = {P = 1e400}", "valid_when = {P = nan}", "minimum = nan",
     f"valid_when = {{P = {2**64}}}"],
)  # fmt: skip
def test_a_signal_map_of_absurd_numbers_is_refused(more: str, tmp_path: Path) -> None:
    with pytest.raises(SignalMapError, match=r"map\.toml"):
        load_signal_map(written(tmp_path, more))


@pytest.mark.parametrize("number", [2**64, -(2**63) - 1, 10**400])
def test_toml_holds_integers_of_64_bits(number: int, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(f"[table]\nlist = [{{ key = {number} }}]\n")
    with pytest.raises(ConfigurationError, match=r"table\.list\.0\.key: an integer beyond 64 bits"):
        read_toml(tmp_path / "a.toml")


@pytest.mark.parametrize(
    ("name", "is_good"),
    [*((name, True) for name in ("van-17", "Van_17.b", "7", "x" * 64)),
     *((name, False) for name in ("a/b", "van 17", "ü", "a+b", "a#b", "..", ".", "-a", "x" * 65, "", "a\\nb"))],
)  # fmt: skip
def test_a_vehicle_id_that_the_fleet_cannot_read_is_refused(name: str, is_good: bool, tmp_path: Path) -> None:
    """`a/b` passed check-config, and none of its records could be read at the fleet."""
    config = service_config(tmp_path)
    config.write_text(config.read_text() + f'\n[vehicle]\nid = "{name}"\n')
    answer = called("check-config", str(config))
    assert (answer.exit_code == 0) is is_good
    assert bool(re.fullmatch(VEHICLE_ID, name)) is is_good
    if not is_good:
        assert "vehicle.id" in str(answer.exception or answer.output)
