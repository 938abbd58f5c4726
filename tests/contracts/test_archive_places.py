"""Whatever keeps an archive, a folder or an object store, keeps it alike."""

import hashlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.archive import object_store

from gateway.archive import Location, PlaceError, place_of
from gateway.errors import ConfigurationError


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    with object_store() as url:
        yield url


@pytest.fixture(params=["local", "s3"])
def place(request: pytest.FixtureRequest, tmp_path: Path, bucket: str) -> Location:
    return place_of(tmp_path if request.param == "local" else f"{bucket}/{tmp_path.name}")


def test_existing_files_are_never_overwritten(place: Location) -> None:
    assert place.create("receipts/vehicle=a/1.json", b"first")
    assert not place.create("receipts/vehicle=a/1.json", b"second")
    assert place.read("receipts/vehicle=a/1.json") == b"first"
    place.replace("receipts/vehicle=a/1.json", b"third")
    assert place.read("receipts/vehicle=a/1.json") == b"third"


def test_a_listing_names_every_file_below_in_order(place: Location) -> None:
    for path in ("b/2", "b/1", "a=x/3", "bb/1"):
        place.create(path, path.encode())
    assert [item.path for item in place.items()] == ["a=x/3", "b/1", "b/2", "bb/1"]
    assert [(item.path, item.size) for item in place.items("b")] == [("b/1", 3), ("b/2", 3)]
    assert place.items("nothing") == []
    assert [item.path for item in place.at("b").items()] == ["1", "2"]


def test_a_stamp_follows_the_content(place: Location) -> None:
    place.create("log", b"one")
    [before] = place.items()
    place.replace("log", b"two")
    [after] = place.items()
    assert (before.path, before.size) == (after.path, after.size)
    assert before.stamp != after.stamp


def test_a_missing_file_is_reported_by_name(place: Location) -> None:
    with pytest.raises(FileNotFoundError, match="nowhere: no such file"):
        place.read("nowhere")
    with pytest.raises(FileNotFoundError, match=r"nowhere\.log: no such file"), place.fetched("nowhere.log"):
        pass
    place.remove("nowhere")


def test_a_large_file_is_fetched_and_removed_afterwards(place: Location) -> None:
    content = bytes(range(256)) * 80_000
    place.create("van/1.log.gz", content)
    with place.fetched("van/1.log.gz") as fetched:
        assert fetched.path.read_bytes() == content
        assert fetched.path.suffixes == [".log", ".gz"]
        assert fetched.sha256 == hashlib.sha256(content).hexdigest()
    assert fetched.path.exists() == (place.local("") is not None)


def test_a_missing_bucket_is_reported_in_one_line(bucket: str) -> None:
    with pytest.raises(PlaceError, match=r"^s3://nobody/x: .*NoSuchBucket|^s3://nobody/x: .*404") as told:
        place_of("s3://nobody/x").items()
    assert "\n" not in str(told.value)


def test_an_unknown_scheme_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"ftp://x/y: ftp:// is not read here; there are file, s3, and paths"):
        place_of("ftp://x/y")
