"""A day of fifteen vehicles in an object store, on a cluster of real processes; one is killed midway."""

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import LocalCluster
from support.archive import Here, object_store, tables_of, uploaded, write_fleet
from support.commands import called

from gateway.archive import failures, place_of, receipts, rows_of, slots_done
from gateway.archive.manifest import load_manifest
from gateway.archive.places import PlaceError
from gateway.archive.reprocessing import Progress, reprocess
from gateway.archive.workers import Workers, workers_of
from gateway.errors import ConfigurationError

N_VEHICLES = 15
KILL_AFTER = 4  # jobs


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    with object_store() as url:
        yield url


@pytest.fixture(scope="module")
def scheduler(bucket: str) -> Iterator[str]:
    """A Dask scheduler with worker processes, which know the object store by their environment."""
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as workers:
        yield workers.scheduler_address


class Killer:
    """Kills a worker's process, once, when some jobs are done."""

    def __init__(self, workers: Workers) -> None:
        self._pids = workers._client.run(os.getpid)
        self.killed: int | None = None

    def __call__(self, progress: Progress) -> None:
        if progress.what == "weighing" and progress.n_done == KILL_AFTER:
            self.killed = min(self._pids.values())
            os.kill(self.killed, signal.SIGKILL)


def test_a_fleet_on_a_cluster_that_loses_a_worker(tmp_path: Path, bucket: str, scheduler: str) -> None:
    archive = write_fleet(tmp_path / "archive", N_VEHICLES).parent
    alone, together = place_of(tmp_path / "alone"), place_of(f"{bucket}/dataset")
    assert reprocess(load_manifest(str(archive)), alone, Here()).is_good
    uploaded(archive, place_of(f"{bucket}/archive"))
    manifest = load_manifest(f"{bucket}/archive")

    with workers_of(scheduler) as workers:
        killer = Killer(workers)
        first = reprocess(manifest, together, workers, killer)
    assert killer.killed is not None
    assert (first.n_jobs, first.is_good) == (N_VEHICLES, True)
    assert first.counts["done"] + first.counts["already"] == N_VEHICLES
    assert tables_of(together) == tables_of(alone)
    assert {len(rows_of(together, slot)) for slot in slots_done(together)[:5]} == {1}
    assert failures(together) == []
    [told] = [one for one in receipts(together) if one["vehicle"] == "van-010"]
    assert [one["log"] for one in told["logs"]] == ["van-010/1.log", "van-010/2.log"]

    before = {item.path: item.stamp for item in together.items()}
    with workers_of(scheduler) as workers:
        second = reprocess(manifest, together, workers)
    assert second.counts == {"done": 0, "already": N_VEHICLES, "lost": 0}
    assert {item.path: item.stamp for item in together.items()} == before


def test_the_command_works_on_a_cluster(tmp_path: Path, bucket: str, scheduler: str) -> None:
    archive = write_fleet(tmp_path / "archive", 2).parent
    uploaded(archive, place_of(f"{bucket}/few"))
    command = ["reprocess", f"{bucket}/few/archive.toml", "--output", f"{bucket}/few_out", "--scheduler", scheduler]
    result = called(*command, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert (told["n_vehicles"], told["n_logs"], told["n_batches"], told["n_weighed"]) == (2, 3, 2, 2)
    assert told["jobs"]["done"] == 2


def test_an_unreachable_scheduler_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.archive.workers.CONNECT_WITHIN_S", 1)
    with pytest.raises(PlaceError, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers within 1 s: start one with"):
        workers_of("tcp://127.0.0.1:9")
    with pytest.raises(ConfigurationError, match="no address of a Dask scheduler"):
        workers_of("nonsense://x")
