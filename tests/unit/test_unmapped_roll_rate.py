"""A signal map that leaves out the roll rate is told the entry that it lacks."""

import re
from pathlib import Path

import pytest

from gateway.bus.signals import load_signal_map
from gateway.bus.signals.signal_map import shipped_map, shipped_maps
from gateway.offline.look.roles import unmapped_roll_rate

ROLL_ENTRY = re.compile(r"^\[signals\.roll_rate\].*?(?=^\[|\Z)", re.DOTALL | re.MULTILINE)
NO_NAMES = ("j1939", "j1939_aceinna")  # their rates are numbered


def without_roll_rate(name: str, folder: Path) -> tuple[Path, str]:
    text = shipped_map(name).read_text(encoding="utf-8")
    entry = ROLL_ENTRY.search(text)
    assert entry is not None
    rest = ROLL_ENTRY.sub("", text).replace('dbc = ["', f'dbc = ["{shipped_map(name).parent}/')
    (folder / "signals.toml").write_text(rest, encoding="utf-8")
    return folder / "signals.toml", entry[0]


@pytest.mark.parametrize("name", [name for name in shipped_maps() if name not in NO_NAMES])
def test_the_entry_is_the_one_that_the_shipped_map_has(name: str, tmp_path: Path) -> None:
    path, entry = without_roll_rate(name, tmp_path)
    proposed = unmapped_roll_rate(load_signal_map(path))
    assert proposed is not None
    for key in ("message", "signal"):
        assert (found := re.search(rf'^{key} = ".*?"', entry, re.MULTILINE)) is not None
        assert found[0] in proposed
    assert "sign = 1, " in proposed or "sign 1 or -1: it must go up as a bend to the left begins" in proposed


@pytest.mark.parametrize("name", NO_NAMES)
def test_where_names_say_nothing_nothing_is_proposed(name: str, tmp_path: Path) -> None:
    assert unmapped_roll_rate(load_signal_map(without_roll_rate(name, tmp_path)[0])) is None


def test_a_map_that_has_it_lacks_nothing() -> None:
    assert unmapped_roll_rate(load_signal_map("springscale:reference")) is None


@pytest.mark.parametrize(
    ("up", "up_sign", "about_left", "left_sign", "expected"),
    [("X", 1, "Z", -1, ("Y", -1)), ("Z", -1, "Y", -1, ("X", 1)), ("Z", 1, "X", 1, ("Y", -1))],
)
def test_the_third_axis_follows_by_the_right_hand_rule(
    up: str, up_sign: int, about_left: str, left_sign: int, expected: tuple[str, int], tmp_path: Path
) -> None:
    """Left x up is forward: x up and left along -z makes forward -y, as a real car's sensor was mounted."""
    path, _ = without_roll_rate("canmod_gps", tmp_path)
    text = path.read_text(encoding="utf-8")
    text = text.replace('"AccelerationZ"\nsign = 1', f'"Acceleration{up}"\nsign = {up_sign}')
    text = text.replace('"AngularRateY"\nsign = 1', f'"AngularRate{about_left}"\nsign = {left_sign}')
    path.write_text(text, encoding="utf-8")
    proposed = unmapped_roll_rate(load_signal_map(path))
    assert proposed is not None
    assert f'"AngularRate{expected[0]}", and sign = {expected[1]}, ' in proposed
