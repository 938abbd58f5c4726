"""check-config calls good only what can run; the help of replay offers only what works here."""

import importlib.util
import re
import sqlite3
from pathlib import Path
from typing import NoReturn

import pytest
from click.testing import Result
from support.calibrated import calibration_text
from support.commands import called

from gateway.bus.signals.signal_map import shipped_map
from gateway.errors import ConfigurationError
from gateway.web.access.tokens import Scope, TokenFile

SOUND = {"bus": 'interface = "virtual"\nchannel = "x"', "web": "port = 0", "batch": "window_s = 300.0"}


def checked(folder: Path, **sections: str) -> Result:
    tables = "\n".join(f"[{name}]\n{text}" for name, text in (SOUND | sections).items())
    path = folder / "springscale.toml"
    path.write_text(f'signals = "springscale:reference"\n[store]\ndirectory = "{folder / "state"}"\n{tables}\n')
    return called("check-config", path)


def test_a_sound_configuration_is_good_and_says_what_weighs_without_a_calibration(tmp_path: Path) -> None:
    found = checked(tmp_path)
    assert found.exit_code == 0
    assert "until one is learnt from drives (page /teach)" in found.stdout


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"bus": 'interface = "socketcn"\nchannel = "can0"'}, "interface 'socketcn' is unknown; known are "),
        ({"bus": 'interface = "udp_multicast"\nchannel = "239.0.0.1"'}, "needs the Python package msgpack"),
        ({"web": 'host = "0.0.0.0"'}, "springscale token create NAME --config"),
        ({"web": "stale_after_s = 200.0"}, "stale_after_s = 200 is below [batch] window_s = 300"),
        ({"alarms": 'off = ["overlaod"]'}, "is no alarm; known are overload, sensor_fault, "),
        ({"learning": 'like = "nothere.json"'}, "nothere.json: no such calibration file"),
        ({"uplink": "statements = true"}, "statements come from a broker: set host"),
        ({"webhook": 'url = "https://fleet.example/hook"'}, "url needs secret_file"),
        (
            {"webhook": 'url = "http://fleet.example/hook"\nsecret_file = "none"'},
            "would cross the network in the clear",
        ),
    ],
)
def test_a_configuration_that_cannot_run_is_refused(
    sections: dict[str, str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found_spec = importlib.util.find_spec
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name, *rest: None if name == "msgpack" else found_spec(name, *rest)
    )
    found = checked(tmp_path, **sections)
    assert isinstance(found.exception, ConfigurationError)
    assert words in str(found.exception)
    assert "springscale.toml: " in str(found.exception)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("gross_limit_kg = 2000", None),
        ("gross_limit_kg = 2.1", "a permitted gross weight of 2.1 kg: the vehicle weighs 1400 kg empty"),
        ("rear_axle_limit_kg = 11000", "an axle limit of 11000 kg on an axle that weighs 700 kg empty"),
    ],
)
def test_limits_that_are_not_this_vehicle_s_are_asked_about(limits: str, said: str | None, tmp_path: Path) -> None:
    """One in tonnes would report every van as too heavy, one in newtons none."""
    (tmp_path / "vehicle.json").write_text(calibration_text(kerb_front_axle_kg=700.0, kerb_rear_axle_kg=700.0))
    checked(tmp_path, vehicle=limits)
    config = tmp_path / "springscale.toml"
    config.write_text(f'calibration = "vehicle.json"\nestimator = "ratio_index"\n{config.read_text()}')
    found = called("check-config", config)
    assert found.exit_code == 0
    assert ("Unlikely, and overloads are reported by it: " in found.stdout) == (said is not None)
    assert (said or "It may weigh: ") in found.stdout


def test_a_map_that_cannot_weigh_is_not_called_good(tmp_path: Path) -> None:
    found = checked(tmp_path)
    assert found.exit_code == 0
    shipped = shipped_map("reference")
    text = re.sub(r"(?ms)^\[signals\.pitch_rate\].*?(?=^\[|\Z)", "", shipped.read_text())
    (tmp_path / "map.toml").write_text(text)
    for dbc in shipped.parent.glob("*.dbc"):
        (tmp_path / dbc.name).write_bytes(dbc.read_bytes())
    config = tmp_path / "springscale.toml"
    config.write_text(config.read_text().replace("springscale:reference", str(tmp_path / "map.toml")))
    again = called("check-config", config)
    assert isinstance(again.exception, ConfigurationError)
    assert "maps no pitch_rate, which every estimate needs" in str(again.exception)


def test_a_store_that_cannot_be_written_is_not_called_good(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("no folder")
    found = checked(tmp_path)
    assert isinstance(found.exception, ConfigurationError)
    assert f"{tmp_path / 'state'} is a file; name a folder" in str(found.exception)


@pytest.mark.parametrize(
    "virtual", ["/proc/springscale", "/proc/sys/springscale", "/proc/self/fd/springscale", "/sys/fs/springscale"]
)
def test_a_store_in_a_file_system_without_files_is_not_called_good(virtual: str, tmp_path: Path) -> None:
    """Root may write there, as permissions go; still no database can be made."""
    checked(tmp_path)
    config = tmp_path / "springscale.toml"
    config.write_text(config.read_text().replace(str(tmp_path / "state"), virtual))
    found = called("check-config", config)
    assert isinstance(found.exception, ConfigurationError)
    assert f"directory = {virtual}: " in str(found.exception)


def test_a_store_is_tried_and_nothing_is_left_behind(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    assert checked(tmp_path).exit_code == 0
    assert list((tmp_path / "state").iterdir()) == []


def test_a_store_on_a_full_disk_is_not_called_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path) -> NoReturn:
        path.write_text("half a page")
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr("gateway.store.schema.connect_writer", full)
    found = checked(tmp_path)
    assert f"{tmp_path} cannot hold a database (database or disk is full)" in str(found.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["springscale.toml"]


def test_every_fault_is_named_at_once(tmp_path: Path) -> None:
    found = checked(tmp_path, bus='interface = "socketcn"', web='host = "0.0.0.0"\nstale_after_s = 20.0')
    assert len(str(found.exception).splitlines()) == 3


def test_an_open_address_needs_a_token_and_tls(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir(mode=0o700)
    TokenFile(tmp_path / "state" / "tokens.json").create("fleet", Scope.READ)
    web = 'host = "0.0.0.0"'
    assert "needs TLS" in str(checked(tmp_path, web=web).exception)  # the token would cross the network in the clear
    assert checked(tmp_path, web=f'{web}\ntls_certificate = "a.pem"\ntls_key = "a.pem"').exit_code == 0


def test_messages_that_ask_for_a_token_say_which_service_it_is_for(tmp_path: Path) -> None:
    """`token create` needs --config, which they once did not mention."""
    tokens = TokenFile(tmp_path / "tokens.json")
    with pytest.raises(ConfigurationError, match=r"token list --config FILE"):
        tokens.revoke("nobody")
    (tmp_path / "tokens.json").write_text("{")
    assert tokens.are_required()
    assert "token create NAME --config FILE" in str(tokens.fault)
