"""deploy/fleet as far as it can be looked at without containers: compose file, certificates, passwords."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.fleet_view import FLEET, provision, write_table

from gateway.config import load_settings
from gateway.fleet.subscriber import Settings as SubscriberSettings
from gateway.uplink.settings import uplink_settings

COMPOSE: dict[str, Any] = yaml.safe_load((FLEET / "compose.yaml").read_text())
MADE_LATER = {"pki", "out", "pki/ca.pem", "out/subscriber"}  # by make_certificates.sh and provision.py
needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")


def test_the_compose_file_is_one_by_its_own_schema() -> None:
    checker = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    done = subprocess.run([*checker, FLEET / "compose.yaml"], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_files_that_the_compose_file_names_exist() -> None:
    mounts = [mount for service in COMPOSE["services"].values() for mount in service.get("volumes", [])]
    mounted = [mount.split(":")[0].removeprefix("./") for mount in mounts]
    named = set(COMPOSE["volumes"])
    missing = [path for path in mounted if path not in named | MADE_LATER and not (FLEET / path).exists()]
    assert missing == []
    build = COMPOSE["services"]["subscriber"]["build"]
    assert (FLEET / build["context"] / build["dockerfile"]).exists()


def test_images_are_pinned_and_every_variable_stands_in_the_example() -> None:
    images = [service["image"] for service in COMPOSE["services"].values() if "image" in service]
    assert all(re.fullmatch(r"[a-z/-]+:\d+(\.\d+)+", image) for image in images), images
    asked = set(re.findall(r"\$\{(\w+)", (FLEET / "compose.yaml").read_text()))
    told = {line.split("=")[0] for line in (FLEET / ".env.example").read_text().splitlines() if "=" in line}
    assert asked == told - {line for line in told if line.startswith("#")}


def test_the_subscriber_gets_its_settings() -> None:
    asked = {name.upper(): field for name, field in SubscriberSettings.model_fields.items()}
    given = set(COMPOSE["services"]["subscriber"]["environment"])
    assert {name for name, field in asked.items() if field.is_required()} <= given
    assert {name for name in given if not name.startswith("PG")} <= set(asked)


@needs_openssl
@pytest.mark.parametrize("name", ["broker.fleet.example", "192.0.2.7"])
def test_the_brokers_certificate_is_renewed_by_the_same_authority(name: str, tmp_path: Path) -> None:
    authorities = []
    for _ in range(2):
        subprocess.run([FLEET / "make_certificates.sh", name, tmp_path / "pki"], check=True, capture_output=True)
        authorities.append((tmp_path / "pki/ca.pem").read_text())
    assert authorities[0] == authorities[1]
    known_as = "-verify_ip" if name[0].isdigit() else "-verify_hostname"
    check = ["openssl", "verify", "-x509_strict", "-CAfile", "ca.pem", known_as, name, "-purpose", "sslserver"]
    subprocess.run([*check, "broker.pem"], cwd=tmp_path / "pki", check=True, capture_output=True)
    assert (tmp_path / "pki/broker.key").stat().st_mode & 0o077 == 0


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    (tmp_path / "ca.pem").write_text("-")
    (tmp_path / "settings.toml").write_text((FLEET / "settings.toml").read_text())
    write_table(tmp_path / "fleet.csv", ["van-1", "van-2", "van-3"])
    return tmp_path


def test_each_vehicle_gets_settings_that_the_service_takes(fleet: Path) -> None:
    provision(fleet, "broker.fleet.example:8884")
    for n, name in enumerate(["van-1", "van-2", "van-3"]):
        folder = fleet / "out/vehicles" / name
        (folder / "fleet-ca.pem").unlink()  # the fixture's is none
        text = (folder / "springscale.toml").read_text().replace('ca = "fleet-ca.pem"\n', "")
        (folder / "springscale.toml").write_text(text)
        settings = load_settings(folder / "springscale.toml")
        assert (settings.vehicle.id, settings.vehicle.vin) == (name, f"WVWZZZ1KZAW{n:06}")
        assert settings.vehicle.gross_limit_kg == 2000.0
        link = uplink_settings(settings.uplink, settings.vehicle)
        assert (link.broker, link.topic, link.username) == ("broker.fleet.example:8884", f"springscale/{name}", name)
        assert link.tls
        assert len(link.password() or "") >= 40
        assert (folder / "broker-password").stat().st_mode & 0o077 == 0
    listed = [line.split(":")[0] for line in (fleet / "out/passwords").read_text().splitlines()]
    assert listed == ["fleet-dispatcher", "fleet-subscriber", "van-1", "van-2", "van-3"]


def test_a_second_run_changes_only_rows_changed_in_the_table(fleet: Path) -> None:
    provision(fleet, "broker.fleet.example")
    before = {path: path.read_bytes() for path in (fleet / "out").rglob("*") if path.is_file()}
    provision(fleet, "broker.fleet.example")
    assert {path: path.read_bytes() for path in (fleet / "out").rglob("*") if path.is_file()} == before
    write_table(fleet / "fleet.csv", ["van-1", "van-4"])
    provision(fleet, "broker.fleet.example")
    assert {path.name for path in (fleet / "out/vehicles").iterdir()} == {"van-1", "van-4"}
    kept = fleet / "out/vehicles/van-1/broker-password"
    assert kept.read_bytes() == before[kept]


def test_a_vehicles_own_files_travel_with_it(fleet: Path) -> None:
    (fleet / "made").mkdir()
    (fleet / "made/van-1.json").write_text("{}")
    (fleet / "settings.toml").write_text('[bus]\nchannel = "can1"\n')
    (fleet / "fleet.csv").write_text("id,vin,calibration,signals\nvan-1,,made/van-1.json,springscale:j1939\n")
    provision(fleet, "broker.fleet.example")
    told = tomllib.loads((fleet / "out/vehicles/van-1/springscale.toml").read_text())
    assert (told["calibration"], told["signals"], told["bus"]["channel"]) == ("van-1.json", "springscale:j1939", "can1")
    assert (fleet / "out/vehicles/van-1/van-1.json").read_text() == "{}"
    assert "vin" not in told["vehicle"]


@pytest.mark.parametrize(
    ("table", "settings", "words"),
    [
        ("id,vin\nvan 1,\n", "", "line 2: id 'van 1'"),
        ("id,vin\n../x,\n", "", "line 2: id '../x'"),
        ("id,vin\nfleet-subscriber,\n", "", "line 2: id 'fleet-subscriber'"),
        ("id,vin\nvan-1,\nvan-1,\n", "", "line 3: van-1"),
        ("id,vin\nvan-1,W1\nvan-2,W1\n", "", "line 3: van-2 or its VIN W1 stands there twice"),
        ("id,vin\n", "", "no vehicle"),
        ("id,vin\nvan-1,\n", '[vehicle]\nid = "x"\n', "[vehicle] is written for each vehicle"),
        ("id,vin,signals\nvan-1,,springscale:j1939\n", 'signals = "a.toml"\n', "the line of van-1 do not fit together"),
        ("id,vin,calibration\nvan-1,,nowhere.json\n", "", "nowhere.json"),
    ],
)
def test_an_unusable_table_is_reported_in_one_line(table: str, settings: str, words: str, fleet: Path) -> None:
    (fleet / "fleet.csv").write_text(table)
    (fleet / "settings.toml").write_text(settings)
    with pytest.raises(subprocess.CalledProcessError) as failed:
        provision(fleet, "broker.fleet.example")
    assert failed.value.returncode == 2
    assert words in failed.value.stderr
    assert "Traceback" not in failed.value.stderr
