"""The manifest of an archive: what it may say, and that every fault in it is told with where and how to mend it."""

from pathlib import Path

import pytest
from support.archive import MIDNIGHT_NS, object_store, uploaded, write_manifest

from gateway.archive import place_of
from gateway.archive.manifest import FOREVER_NS, load_manifest
from gateway.archive.survey import is_log
from gateway.errors import ConfigurationError


def test_a_manifest_maps_folders_to_vehicles_with_common_settings(tmp_path: Path) -> None:
    path = write_manifest(tmp_path, "van-1", 'vin = "WF0XXXTTGXJK12345"', 'id = "van-3"\nlogs = "/elsewhere/3"')
    manifest = load_manifest(str(path))
    assert manifest.where == load_manifest(str(tmp_path)).where == str(path)
    assert [one.vehicle for one in manifest.assignments] == ["van-1", "WF0XXXTTGXJK12345", "van-3"]
    assert [str(one.logs) for one in manifest.assignments] == [
        str(tmp_path / "van-1"),
        str(tmp_path / "WF0XXXTTGXJK12345"),
        "/elsewhere/3",
    ]
    assert manifest.assignments[1].vin == "WF0XXXTTGXJK12345"
    assert manifest.assignments[0].setup is manifest.assignments[2].setup
    assert (manifest.settings.window_s, manifest.settings.provisional_every_s) == (20.0, 0.0)


def test_validity_in_time_is_a_day_or_an_instant(tmp_path: Path) -> None:
    path = write_manifest(
        tmp_path, 'id = "v"\nuntil = 2026-11-01', 'id = "v"\nsince = 2026-11-01T00:00:00Z\nestimator = "ratio_index"'
    )
    assert [one.span_ns for one in load_manifest(str(path)).assignments] == [
        (-FOREVER_NS, MIDNIGHT_NS),
        (MIDNIGHT_NS, FOREVER_NS),
    ]


def test_a_manifest_lies_in_an_object_store_with_all_it_names(tmp_path: Path) -> None:
    write_manifest(tmp_path, "van-1")
    with object_store() as bucket:
        uploaded(tmp_path, place_of(f"{bucket}/archive"))
        [one] = load_manifest(f"{bucket}/archive").assignments
        assert one.logs.url == f"{bucket}/archive/van-1"
        assert one.setup.calibration is not None
        with pytest.raises(ConfigurationError, match=r"s3:.*/nothing: has no archive\.toml"):
            load_manifest(f"{bucket}/nothing")


OF_MAP = 'signals = "springscale:reference"\n'
FAULTS = [
    (OF_MAP, r"archive\.toml: names no vehicle; write \[\[vehicles\]\] with id or vin"),
    ("signals = 1\nvehicles = []", r"archive\.toml: signals: Input should be a valid string \(it says 1\)"),
    ("vehicles = [{}]", r"vehicles\[1\]: give id or vin: nothing tells whose logs these are"),
    ('vehicles = [{id = "a", vins = "x"}]', r"vehicles\[1\]\.vins: unknown key"),
    ('vehicles = [{id = "../a"}]', r"vehicles\[1\]\.id: String should match pattern"),
    ('vehicles = [{id = "a"}]', r"vehicles\[1\]\.signals: missing; give it here, or at the top for every vehicle"),
    ('vehicles = [{id = "a", since = 2026-11-02, until = 2026-11-01}]', r"vehicles\[1\]: since must be before until"),
    ('vehicles = [{id = "a", since = 2026-11-02T10:00:00}]', r"vehicles\[1\]\.since: .*timezone"),
    (
        OF_MAP + 'vehicles = [{id = "a"}, {id = "a", logs = "b", since = 2026-11-01}]',
        r"vehicles\[2\]: vehicle a is in vehicles\[1\] too, at the same time; part them by since and until",
    ),
    (OF_MAP + 'vehicles = [{id = "a"}, {id = "b", logs = "a"}]', r"vehicles\[2\]: folder a is in vehicles\[1\] too"),
    (
        OF_MAP + 'vehicles = [{id = "a"}, {id = "b", logs = "./a//"}]',
        r"vehicles\[2\]: folder a is in vehicles\[1\] too",
    ),
    (
        OF_MAP + 'vehicles = [{id = "c", logs = "a/c"}, {id = "a"}]',
        r"vehicles\[1\]: folder a/c lies in that of vehicles\[2\] too, at the same time; part them by since",
    ),
    (
        OF_MAP + 'vehicles = [{id = "a"}, {id = "b", logs = "."}]',
        r"vehicles\[1\]: folder a lies in that of vehicles\[2\] too",
    ),
    ('signals = "none.toml"\nvehicles = [{id = "a"}]', r"none\.toml: no such file"),
    (OF_MAP + 'vehicles = [{id = "a", calibration = "none.json"}]', r"none\.json: no such calibration file"),
    ("batch.window_s = 5\nvehicles = []", r"batch\.window_s: 5 is below 20"),
    ("vehicles = [", r"archive\.toml: not valid TOML"),
]


@pytest.mark.parametrize(("text", "told"), FAULTS)
def test_a_fault_is_reported_with_its_place_and_remedy(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "archive.toml").write_text(text)
    with pytest.raises(ConfigurationError, match=told):
        load_manifest(str(tmp_path))


def test_the_extension_decides_what_is_a_log() -> None:
    names = ("a.log", "b/c.LOG.gz", "d.mf4", "truth.csv", "notes.txt", ".e.log")
    assert [name for name in names if is_log(name)] == ["a.log", "b/c.LOG.gz", "d.mf4"]
