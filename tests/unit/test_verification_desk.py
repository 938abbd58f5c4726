"""Known loads against what was weighed: errors, verdict, a record that stays, and when the next is due."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.epochs import START_NS, drive_of, stored
from support.verification import CALIBRATED, RULE, verification_desk

from gateway.calibration.known_weight import WeightRefusal
from gateway.errors import RefusedError
from gateway.records import iso_utc
from gateway.stated.facts import Drive, StatedWeight
from gateway.store import Store

DAY_NS = 86_400_000_000_000
AT = iso_utc(START_NS + 60_000_000_000)
HEAVY = iso_utc(START_NS + 7_260_000_000_000)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    """Two drives of the calibration in use, weighed as 112 kg and as 380 kg, 50 % in front."""
    light = drive_of(3, 112.0, calibration_id=CALIBRATED.id)
    heavy = drive_of(2, 380.0, start_ns=START_NS + 7_200_000_000_000, calibration_id=CALIBRATED.id)
    opened = stored(tmp_path / "store", light, heavy)
    yield opened
    opened.close()


def verified(tmp_path: Path, store: Store, *stated: StatedWeight, **options: Any) -> dict[str, Any]:
    return json.loads(verification_desk(tmp_path, store, **options).verify("workshop", None, stated))


def test_an_error_is_weighed_less_known_and_judged_against_the_whole(tmp_path: Path, store: Store) -> None:
    record = verified(tmp_path, store, StatedWeight(AT, payload_kg=100.0, position_m=1.4))
    (load,) = record["loads"]
    assert (load["error_kg"], load["known_reference_kg"]) == (12.0, 1340.0)  # no unsprung mass is known
    assert load["error_pct"] == pytest.approx(100.0 * 12.0 / 1340.0)
    assert (record["verdict"], load["is_within"], load["n_batches"]) == ("passed", True, 3)
    assert load["payload_std_kg"] < 5.0  # of all its batches together
    front = load["front_axle"]
    assert (front["known_kg"], front["error_kg"]) == pytest.approx((670.0, 0.5 * 1352.0 - 670.0))
    assert record["calibration_id"] == CALIBRATED.id
    assert (record["by"], record["note"]) == ("workshop", None)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"permitted_error_pct": 0.8}, "failed"),
        ({"permitted_error_pct": 0.9}, "passed"),
        ({"permitted_axle_error_pct": 0.8}, "failed"),
        ({"permitted_axle_error_pct": 0.9}, "passed"),
        ({"loads": 2}, "failed"),
    ],
)
def test_the_rule_decides(tmp_path: Path, store: Store, change: dict[str, float], verdict: str) -> None:
    rule = RULE.model_copy(update=change)
    stated = StatedWeight(AT, payload_kg=100.0, position_m=1.4)
    assert verified(tmp_path, store, stated, rule=rule)["verdict"] == verdict


def test_several_loads_in_one_record_pass_together_or_fail(tmp_path: Path, store: Store) -> None:
    good, bad = StatedWeight(AT, payload_kg=100.0), StatedWeight(HEAVY, payload_kg=280.0)
    record = verified(tmp_path, store, good, bad)
    assert ([load["is_within"] for load in record["loads"]], record["verdict"]) == ([True, False], "failed")
    assert record["loads"][1]["front_axle"] is None


def test_records_stay_and_are_told_newest_first(tmp_path: Path, store: Store) -> None:
    ids = [verified(tmp_path, store, StatedWeight(AT, payload_kg=float(kg)))["id"] for kg in (100, 110)]
    desk = verification_desk(tmp_path, store)
    told = json.loads(desk.state())
    assert [entry["id"] for entry in told["history"]] == ids[::-1]
    found = desk.record(ids[0])
    assert found["id"] == ids[0]
    assert desk.record("sha256:none") is None


def refusal_of(tmp_path: Path, store: Store, stated: StatedWeight) -> str:
    desk = verification_desk(tmp_path, store)
    with pytest.raises(RefusedError) as refused:
        desk.verify("workshop", None, [stated])
    assert json.loads(desk.state())["history"] == []
    return refused.value.reason


def test_what_cannot_be_judged_is_refused_and_leaves_no_trace(tmp_path: Path, store: Store) -> None:
    assert refusal_of(tmp_path, store, StatedWeight("2020-01-01T00:00:00Z", payload_kg=1.0)) == WeightRefusal.NO_EPOCH
    between = iso_utc(START_NS + 3_600_000_000_000)
    assert refusal_of(tmp_path, store, StatedWeight(between, payload_kg=1.0)) == WeightRefusal.AMBIGUOUS_EPOCH
    gross = StatedWeight(between, gross_kg=1500.0, drive=Drive.BEFORE)
    assert refusal_of(tmp_path, store, gross) == WeightRefusal.NO_UNSPRUNG_MASS


def test_a_load_weighed_by_another_calibration_proves_nothing_of_this(tmp_path: Path) -> None:
    store = stored(tmp_path / "store", drive_of(2, 100.0, calibration_id="sha256:other"))
    assert refusal_of(tmp_path, store, StatedWeight(AT, payload_kg=100.0)) == WeightRefusal.OTHER_CALIBRATION
    store.close()


def test_a_disk_that_refuses_keeps_no_record_and_says_so(tmp_path: Path, store: Store) -> None:
    (tmp_path / ".verifications.json.new").mkdir()
    assert refusal_of(tmp_path, store, StatedWeight(AT, payload_kg=100.0)) == WeightRefusal.NOT_STORED


def test_it_is_due_until_one_has_passed_and_again_later(tmp_path: Path, store: Store) -> None:
    now_ns = [START_NS]
    desk = verification_desk(tmp_path, store, every_days=30.0, clock_ns=lambda: now_ns[0])
    assert (desk.status().is_due, desk.status().last_at) == (True, None)
    assert "verification with known loads is due" in str(desk.fault)
    desk.verify("a", None, [StatedWeight(AT, payload_kg=400.0)])  # fails
    assert (desk.status().is_due, desk.status().last_verdict) == (True, "failed")
    desk.verify("a", None, [StatedWeight(AT, payload_kg=112.0)])
    assert (desk.status().is_due, desk.fault) == (False, None)
    assert desk.status().due_at == iso_utc(START_NS + 30 * DAY_NS)
    now_ns[0] += 31 * DAY_NS
    assert desk.status().is_due
    assert "the last was 2026-09-21" in str(desk.fault)


def test_it_is_never_due_where_nobody_asks_for_it(tmp_path: Path, store: Store) -> None:
    desk = verification_desk(tmp_path, store)
    assert (desk.status().is_due, desk.status().due_at, desk.fault) == (False, None, None)


@pytest.mark.parametrize("content", ["{", '{"format": "other"}', '{"version": 1, "entries": [{"id": "x"}]}', "\0\0"])
def test_a_file_that_cannot_be_believed_is_set_aside(tmp_path: Path, store: Store, content: str) -> None:
    (tmp_path / "verifications.json").write_text(content)
    desk = verification_desk(tmp_path, store)
    assert "set aside as verifications.json.broken-" in str(desk.fault)
    desk.verify("a", None, [StatedWeight(AT, payload_kg=112.0)])
    assert desk.fault is None
    (aside,) = tmp_path.glob("*.broken-*")
    assert aside.read_text() == content
    assert len(json.loads(verification_desk(tmp_path, store).state())["history"]) == 1
