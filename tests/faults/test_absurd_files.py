"""Files that people give: each is read, or refused with one clear line, in time proportional to its size."""

import re
from contextlib import suppress
from pathlib import Path

import pytest
from support.commands import called
from support.configured import service_config

from gateway.bus.signals import load_signal_map
from gateway.config import VEHICLE_ID
from gateway.errors import ConfigurationError, SignalMapError
from gateway.files.toml_file import read_toml

HUGE = "9" * 400
DBC = """VERSION ""
NS_ :
BS_:
BU_: X
BO_ 304 IMU: 8 X
 SG_ A : 7|16@0- ({scale}) [{range}] "m/s^2" X
 SG_ P : 23|16@0- (0.001,0) [0|0] "rad/s" X
{more}
"""
MAP = 'dbc = ["a.dbc"]\n[signals.vertical_acceleration]\nmessage = "IMU"\nsignal = "A"\n'
WHOLE = {"scale": "0.1,0", "range": "0|0", "more": ""}

REFUSED_DATABASES = {
    "a scale of 400 digits": {"scale": f"{HUGE},0"},
    "an offset of 400 digits": {"scale": f"1,{HUGE}"},
    "an infinite scale": {"scale": "1e400,0"},
    "a signal that begins at 400 digits": {"more": f' SG_ Q : {HUGE}|8@1+ (1,0) [0|0] "" X'},
    "a signal of a billion bits": {"more": ' SG_ Q : 0|1000000000@1+ (1,0) [0|0] "" X'},
}
HARMLESS_DATABASES = {  # a range that no float holds counts as none; of the others the map names nothing
    "a range of 400 digits": {"range": f"-{HUGE}|{HUGE}"},
    "a start value of 400 digits": {
        "more": f'BA_DEF_ SG_ "GenSigStartValue" INT 0 1;\nBA_ "GenSigStartValue" SG_ 304 A {HUGE};'
    },
    "a message of 400 digits": {"more": f"BO_ 305 N: {HUGE} X"},
}
LONG_DATABASES = {  # the first three took more than an hour: the square of their length
    "blank lines": "\n" * 300_000 + "x",
    "blank lines before signals": ("\n" * 20) * 20_000 + " SG_ ",
    "an endless name": " SG_ " + "w" * 300_000,
    "an endless line of names": " SG_ " + "a " * 100_000,
    "an endless start": " SG_ Q : " + "1" * 300_000,
    "endless zeros": " SG_ Q : 0 | " + "0" * 300_000,
    "colons": " SG_ Q : " + " : " * 100_000,
    "an endless identifier": "BO_ " + "0" * 300_000,
    "tabs": "\n".join(["\t" * 1000] * 300) + "x",
    "an open text": 'CM_ "' + "a" * 300_000,
}


def written(folder: Path, of_map: str = "", **parts: str) -> Path:
    (folder / "a.dbc").write_text(DBC.format(**WHOLE | parts))
    (folder / "map.toml").write_text(MAP + of_map)
    return folder / "map.toml"


def test_the_database_is_read_without_what_is_absurd(tmp_path: Path) -> None:
    assert len(load_signal_map(written(tmp_path)).signals) == 1


@pytest.mark.parametrize("what", REFUSED_DATABASES)
def test_a_database_of_absurd_numbers_is_refused(what: str, tmp_path: Path) -> None:
    with pytest.raises(SignalMapError, match=r"a\.dbc") as refusal:
        load_signal_map(written(tmp_path, **REFUSED_DATABASES[what]))
    assert len(str(refusal.value)) < 1000


@pytest.mark.parametrize("what", HARMLESS_DATABASES)
def test_absurd_numbers_that_no_mapped_signal_needs_do_no_harm(what: str, tmp_path: Path) -> None:
    """Each ended in OverflowError."""
    mapped, sound = (
        load_signal_map(written(tmp_path, **parts)).messages[0].signals[0] for parts in (HARMLESS_DATABASES[what], {})
    )
    assert (mapped.minimum, mapped.maximum) == (sound.minimum, sound.maximum)


@pytest.mark.parametrize("what", LONG_DATABASES)
def test_a_database_is_read_in_time_proportional_to_its_length(what: str, tmp_path: Path) -> None:
    with suppress(SignalMapError):
        load_signal_map(written(tmp_path, more=LONG_DATABASES[what]))


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
