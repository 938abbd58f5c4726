"""springscale record fetch: a link that breaks is taken up again, and a file has its name only once it is whole."""

import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from gateway.cli import springscale
from gateway.cli.service import Service
from gateway.errors import SpringscaleError

CONTENT = bytes(range(256)) * 40
ITEM = {
    "name": "00000001-20260922T000000Z.log.gz",
    "n_bytes": len(CONTENT),
    "n_frames": 7,
    "t_start": "2026-09-22T00:00:00.000000Z",
    "t_end": "2026-09-22T00:10:00.000000Z",
}


def fetched(monkeypatch: pytest.MonkeyPatch, output: Path, *sent: int) -> tuple[Result, list[str]]:
    """From a service whose link breaks after so many bytes of each answer."""
    asked: list[str] = []
    lengths = iter(sent)

    @contextmanager
    def opened(self: Service, path: str, *_: Any, more: dict[str, str] | None = None) -> Iterator[io.BytesIO]:
        if more is None:
            yield io.BytesIO(json.dumps({"items": [ITEM]}).encode())
            return
        asked.append(more["Range"])
        begin = int(more["Range"].removeprefix("bytes=").partition("-")[0])
        yield io.BytesIO(CONTENT[begin : begin + next(lengths)])
        raise SpringscaleError("the link broke")

    monkeypatch.setattr(Service, "opened", opened)
    arguments = ["record", "fetch", "--output", str(output), "--url", "http://van"]
    return CliRunner().invoke(springscale, arguments), asked


def test_a_link_that_breaks_is_taken_up_where_it_broke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = tmp_path / "drive.log.gz"
    found, asked = fetched(monkeypatch, output, 1000, 4000, 99_999)
    assert found.exit_code == 0, found.exception
    assert output.read_bytes() == CONTENT
    last = len(CONTENT) - 1
    assert asked == [f"bytes=0-{last}", f"bytes=1000-{last}", f"bytes=5000-{last}"]
    assert list(tmp_path.iterdir()) == [output]


def test_one_that_brings_nothing_any_more_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = fetched(monkeypatch, tmp_path / "drive.log.gz", 1000, 0)
    assert "the link broke" in str(found.exception)
    assert len(asked) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_is_no_fault_of_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = fetched(monkeypatch, tmp_path / "no such folder" / "drive.log.gz", 99_999)
    assert isinstance(found.exception, SpringscaleError)
    assert "drive.log.gz: cannot be written: No such file or directory" in str(found.exception)
