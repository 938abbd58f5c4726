"""The demonstration: simulator, bus, service, database, and what it tells of a load it was not told."""

import json

from click.testing import CliRunner

from gateway.cli import springscale


def test_the_demo_weighs_the_van_before_and_after_loading() -> None:
    found = CliRunner().invoke(springscale, ["demo", "--once", "--json"], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    records = [json.loads(line) for line in found.stdout.splitlines()]
    counted = [record for record in records if not record["rejected"]]
    payloads = [record["payload_kg"] for record in counted]
    assert len(payloads) == 5
    assert all(abs(payload) < 60.0 for payload in payloads[:3])
    assert all(abs(payload - 270.0) < 60.0 for payload in payloads[3:])
    assert [record["epoch_n_batches"] for record in counted] == [1, 2, 3, 1, 2]  # the stop opened a new epoch
    assert counted[2]["epoch_payload_std_kg"] < counted[2]["payload_std_kg"]
