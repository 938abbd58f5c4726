"""Settings, manifests of archives and campaigns of any content are read or refused in words, soon and in little memory.

Signal maps are tried with the other files of a bus.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from support.archive import write_manifest
from support.calibrated import calibration_file
from support.configured import service_config
from support.spoiled import Change, changed, changes, refusal_of

from gateway.archive.manifest import load_manifest
from gateway.calibration.campaign_file import load_campaign
from gateway.config import load_settings
from gateway.errors import SpringscaleError

N_FILES: Final = 500  # of each kind
WORDS: Final = [
    *b'true [] {} [[1]] 1979-05-27 2026-01-01T00:00:00 \'x\' "" """ \'../\' -1.0 +nan -inf "\\ud800" [batch]'.split(),
    *(
        b"[[vehicles]]\n",
        b"[[runs]]\n",
        b"vin = 'I'\n",
        b"window_s = 1e300\n",
        b"since = 2026-01-01\n",
        b"port = 70000\n",
    ),
]
CAMPAIGN: Final = """signals = "springscale:reference"
[vehicle]
name = "van"
empty_mass_kg = 1240.0
wheelbase_m = 2.8
sensor_position_m = 3.2
[[runs]]
log = "a.log"
payload_kg = 0.0
[[runs]]
log = "a.log"
payload_kg = 270.0
payload_position_m = 0.5
"""


def with_settings(folder: Path) -> Path:
    more = '[batch]\nwindow_s = 120.0\n[alarms]\noff = ["overload"]\n[record]\nenabled = true\n[uplink]\nhost = "x"\n'
    return service_config(folder, calibration_file().to_json(), more)


def with_manifest(folder: Path) -> Path:
    entry = 'id = "van-1"\nvin = "WVWZZZ1JZXW000001"\nuntil = 2026-11-01\ngross_limit_kg = 2500.0'
    return write_manifest(folder, entry, 'id = "van-1"\nsince = 2026-11-01T00:00:00Z\nlogs = "van-1"')


def with_campaign(folder: Path) -> Path:
    (folder / "a.log").touch()
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return folder / "campaign.toml"


FILES: Final[dict[str, tuple[Callable[[Path], Path], Callable[[Path], object]]]] = {
    "settings": (with_settings, load_settings),
    "manifest": (with_manifest, lambda path: load_manifest(str(path))),
    "campaign": (with_campaign, load_campaign),
}


@pytest.mark.parametrize("kind", FILES)
@settings(
    max_examples=N_FILES,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(where=st.one_of(st.just([]), changes(WORDS)))
@example(where=[(0, False, 0, b"a = " + b"[" * 5000)])
@example(where=[(0, False, 0, b"a" + b".a" * 5000 + b" = 1\n")])
def test_a_file_of_any_content_is_read_or_refused_in_words(kind: str, where: list[Change], tmp_path: Path) -> None:
    write, load = FILES[kind]
    path = write(tmp_path)
    path.write_bytes(changed(path.read_bytes(), where))
    refused = refusal_of(SpringscaleError, lambda: load(path))
    assert refused is None or (str(tmp_path) in refused and len(refused) < 20_000)
    assert where or refused is None
