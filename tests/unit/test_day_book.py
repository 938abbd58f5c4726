"""The service's day book: what it stores is what a log tells, and a restart in the middle changes nothing of it."""

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from support.days import day, told
from support.patience import PATIENCE_S

from gateway.core.change import Rules
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.service.batch_log import LoadEventLog
from gateway.setup import load_setup
from gateway.store import Store

WHOLE = day(0.0, 500.0, 500.0, 320.0, 200.0, batches=2)


def run(directory: Path, estimates: list[Estimate]) -> dict[str, dict]:
    """One run of the service over these; what is stored afterwards, by id."""
    with closing(Store.open(directory)) as store:
        book = LoadEventLog(load_setup("springscale:reference"), store)
        for one in estimates:
            store.write_estimate(estimate_to_json(one))
            book(one)
        assert store.flush(PATIENCE_S)
        return {record["id"]: record for record in map(json.loads, store.reader().entries(limit=1000).items)}


@pytest.mark.parametrize(
    ("n_ahead", "cut"), [*((0, cut) for cut in (0, 1, 3, 5, 8, len(WHOLE))), *((4, cut) for cut in (3, 4, 5, 8))]
)
def test_restarts_do_not_change_the_stored_events(tmp_path: Path, n_ahead: int, cut: int) -> None:
    """Nor after a clock that was three days ahead for so many batches was put back."""
    ahead_ns = 3 * 24 * 3600 * 10**9
    ahead = [replace(n, t_start_ns=n.t_start_ns + ahead_ns, t_end_ns=n.t_end_ns + ahead_ns) for n in WHOLE[:n_ahead]]
    whole = [*ahead, *WHOLE[n_ahead:]]
    run(tmp_path, whole[:cut])
    stored = run(tmp_path, whole[cut:])
    assert stored == {entry.id: entry.record for entry in told(whole, Rules()).values()}
