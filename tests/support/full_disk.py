"""A process whose files may not grow for a while: what a full disk does to the store. Prints what it saw."""

import dataclasses
import json
import resource
import sys
from pathlib import Path

from gateway.status import StoreState
from gateway.store import Store
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until


def main(directory: Path) -> None:
    store = Store.open(directory)
    for n in range(3):
        store.write_estimate(make_record(n))
    is_written = store.flush(PATIENCE_S)

    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1, hard))
    for n in range(3, 9):
        store.write_estimate(make_record(n))
    wait_until(lambda: store.health().state is StoreState.DEGRADED)
    is_written_while_full = store.flush(0.0)
    full, seen_while_full = store.health(), store.reader().estimates().items

    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    is_written_afterwards = store.flush(PATIENCE_S)
    healed, seen_afterwards = store.health(), store.reader().estimates().items
    sys.stdout.write(
        json.dumps(
            {
                "is_written": [is_written, is_written_while_full, is_written_afterwards],
                "full": dataclasses.asdict(full),
                "healed": dataclasses.asdict(healed),
                "n_lost": store.close(PATIENCE_S),
                "seen_while_full": seen_while_full,
                "seen_afterwards": seen_afterwards,
            }
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
