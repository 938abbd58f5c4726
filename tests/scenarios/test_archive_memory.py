"""A worker's memory does not grow with the length of a log."""

import tracemalloc
from pathlib import Path

from support.archive import MIDNIGHT_NS, S, write_drive, write_manifest

from gateway.archive import place_of
from gateway.archive.inventory import look
from gateway.archive.job_run import run
from gateway.archive.jobs import ArchiveJob
from gateway.archive.manifest import load_manifest
from gateway.archive.survey import survey

N_PIECES = 10
N_SHORT = 4  # longer than what is read at a time
PIECE_S = 300


def most_bytes_held(job: ArchiveJob) -> int:
    """The most that Python and numpy hold at a time while a job is done."""
    tracemalloc.start()
    try:
        run(job)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_long_log_takes_no_more_memory_than_a_short_one(tmp_path: Path) -> None:
    pieces = []
    for n in range(N_PIECES):
        write_drive(tmp_path / "piece.log", MIDNIGHT_NS + n * PIECE_S * S, PIECE_S, seed=n)
        pieces.append((tmp_path / "piece.log").read_bytes())
    for name, content in (("short", b"".join(pieces[:N_SHORT])), ("long", b"".join(pieces))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "1.log").write_bytes(content)
    manifest = load_manifest(str(write_manifest(tmp_path, "short", "long")))
    inventory = look(manifest, place_of(tmp_path / "dataset"))
    for vehicle, logs in inventory.unknown():
        inventory.learn(vehicle, {log.key: survey(log) for log in logs})
    long, short = inventory.jobs()
    assert long.size - short.size > 15_000_000
    held, held_longer = most_bytes_held(short), most_bytes_held(long)
    assert held_longer - held < 0.2 * (long.size - short.size)
