"""Known weights at a service: in use from the next batch on, held where contradicted, taken back to the last bit."""

import errno
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.known_weights import CALIBRATED, KnownWeightBench
from support.log import fields_of, names

from gateway.calibration.known_weight import STD_KG, WeightRefusal
from gateway.calibration.known_weights_file import FILE_NAME, MOST_KNOWN_WEIGHTS, load_known_weights
from gateway.core.known_weights import KnownWeightKind
from gateway.errors import ConfigurationError, RefusedError
from gateway.files.kept import KeptFiles
from gateway.log import Event
from gateway.posterior import FRONT_SHARE, PAYLOAD, Posterior, Source
from gateway.service.verification.epochs import epoch_at, epochs_around
from gateway.stated.facts import StatedWeight

LOADS_KG = (276.0, 398.0, 131.0, 250.0)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[KnownWeightBench]:
    made = KnownWeightBench(tmp_path, *LOADS_KG)
    yield made
    made.store.close()


def refusal(ask: Callable[[], Any]) -> str:
    with pytest.raises(RefusedError) as refused:
        ask()
    return refused.value.reason


def bits(posterior: Posterior) -> bytes:
    columns = [posterior.sources[name].tobytes() for name in sorted(posterior.sources)]
    return b"".join([posterior.mean.tobytes(), posterior.own.tobytes(), *columns])


def test_empty_now_is_on_disk_in_use_and_says_where_it_is_from(bench: KnownWeightBench) -> None:
    before = bench.pipeline.shown(200.0)
    made = bench.empty()
    assert (made["kind"], made["payload_kg"], made["payload_std_kg"], made["stated"]) == ("empty", 0.0, 10.0, None)
    assert made["front_share_pct"] == 50.0  # the empty vehicle's, as it was stated
    assert made["estimated_payload_kg"] == 12.0
    assert (made["by"], made["vehicle_id"], made["state"], made["ended"]) == ("workshop", "van-17", "in_use", None)
    assert (made["calibration_id"], made["estimator"], made["batch_ids"]) == (CALIBRATED.id, "ratio_index", ["batch-1"])
    assert [entry.id for entry in bench.kept.entries] == [made["id"]]
    assert bench.events == ["known_weight_stated"]
    state = bench.state()
    assert (state["history"], state["known_weights_id"], state["n_teaching"]) == ([made], bench.in_use, 1)
    after = bench.pipeline.shown(200.0)
    assert after.mean[PAYLOAD] < before.mean[PAYLOAD]  # it read too much when it was empty
    assert after.std(PAYLOAD) < before.std(PAYLOAD)


def test_the_empty_share_as_stated_is_no_measurement_of_itself(bench: KnownWeightBench) -> None:
    """It moves estimates and what is stated alike: an empty vehicle says nothing of it, weighed axles do."""
    bench.empty()
    unmoved = bench.pipeline.shown(200.0).sources[Source.EMPTY_SHARE]
    assert unmoved[0, FRONT_SHARE] == pytest.approx(0.4)
    vehicle = CALIBRATED.vehicle
    (entry,) = bench.kept.entries
    assert Source.EMPTY_SHARE not in entry.observation.posterior.sources
    assert vehicle.empty_front_share_pct == entry.front_share_pct


def test_a_ticket_narrows_other_loads_and_keeps_both_numbers(bench: KnownWeightBench) -> None:
    before = bench.pipeline.shown(400.0)
    made = bench.ticket(0, 300.0)
    assert (made["payload_kg"], made["estimated_payload_kg"]) == (300.0, pytest.approx(276.0, abs=1e-6))
    assert (made["n_batches"], made["state"]) == (2, "in_use")
    after = bench.pipeline.shown(400.0)
    assert after.std(PAYLOAD) < 0.9 * before.std(PAYLOAD)
    assert after.mean[PAYLOAD] > before.mean[PAYLOAD]
    assert (bench.state()["mean_error_kg"], bench.state()["error_std_kg"]) == (pytest.approx(-24.0, abs=1e-6), None)


def test_a_ticket_of_400_kg_under_a_load_that_reads_276_is_held_until_somebody_confirms_it(
    bench: KnownWeightBench,
) -> None:
    before = [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG]
    made = bench.ticket(0, 400.0)
    assert (made["state"], made["is_contradicted"]) == ("held", True)
    assert [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG] == before
    assert bench.in_use is None
    said = str(bench.service.fault)
    assert "known weight of 400 kg contradicts the estimate of 276 ±" in said
    state = json.loads(bench.service.confirm("office", made["id"]))
    (entry,) = state["history"]
    assert (entry["state"], entry["confirmed"]["by"], entry["id"]) == ("in_use", "office", made["id"])
    assert (bench.in_use, bench.service.fault) == (state["known_weights_id"], None)
    assert refusal(lambda: bench.service.confirm("office", made["id"])) == WeightRefusal.NOT_HELD
    bench.restart()
    assert bench.in_use == state["known_weights_id"]


def test_what_is_known_already_contradicts_a_false_ticket_sooner(tmp_path: Path) -> None:
    """Two tickets that agree with their loads leave no room for one that is 80 kg off."""
    bench = KnownWeightBench(tmp_path, 276.0, 398.0, 276.0)
    alone = bench.ticket(2, 356.0)
    assert alone["state"] == "in_use"
    bench.service.take_back("workshop", alone["id"])
    bench.ticket(0, 276.0)
    bench.ticket(1, 398.0)
    assert bench.ticket(2, 356.0)["state"] == "held"
    bench.store.close()


@pytest.mark.parametrize("off_kg", [-270.0, -150.0, -60.0, 60.0, 124.0])
@pytest.mark.parametrize("std_kg", [5.0, 50.0])
def test_one_false_ticket_moves_the_sources_by_no_more_than_its_error_and_theirs_allow(
    bench: KnownWeightBench, off_kg: float, std_kg: float
) -> None:
    """Confirmed against all advice. It moves another load by the part of its error that common causes may have."""
    before = {kg: bench.pipeline.shown(kg) for kg in LOADS_KG}
    made = bench.ticket(0, 276.0 + off_kg, std_kg=std_kg)
    if made["state"] == "held":
        bench.service.confirm("office", made["id"])
    (entry,) = bench.kept.entries
    seen = entry.observation.posterior
    lasting = {name: seen.sources[name] for name in seen.sources if name not in (Source.LOAD_LENGTH, Source.MODEL)}
    noise = float(seen.without(*lasting).covariance[PAYLOAD, PAYLOAD]) + std_kg**2
    common = sum(float(np.sum(columns[:, PAYLOAD] ** 2)) for columns in lasting.values())
    t_ns = entry.observation.t_ns  # the days' sources as they were then
    for kg, was in before.items():
        is_now = bench.pipeline.shown(kg, t_ns)
        across = sum(float(was.sources[name][:, PAYLOAD] @ columns[:, PAYLOAD]) for name, columns in lasting.items())
        moved_kg = is_now.mean[PAYLOAD] - was.mean[PAYLOAD]
        assert moved_kg == pytest.approx(off_kg * across / (common + noise), rel=1e-6)
        theirs = np.sqrt(sum(float(np.sum(was.sources[name][:, PAYLOAD] ** 2)) for name in lasting))
        assert abs(moved_kg) <= theirs * abs(off_kg) / np.sqrt(common + noise) + 1e-9
        assert abs(moved_kg) < 1.6 * abs(off_kg)
        assert is_now.std(PAYLOAD) <= was.std(PAYLOAD) + 1e-9


def test_taking_one_back_restores_the_numbers_to_the_last_bit(bench: KnownWeightBench) -> None:
    plain = [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG]
    first = bench.ticket(0, 280.0)
    with_one = [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG]
    id_of_one = bench.in_use
    empty, last = bench.empty(), bench.ticket(1, 410.0)
    assert [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG] != with_one
    bench.service.take_back("office", empty["id"])
    bench.service.take_back("office", last["id"])
    assert [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG] == with_one
    assert bench.in_use == id_of_one
    state = json.loads(bench.service.take_back("office", first["id"]))
    assert [bits(bench.pipeline.shown(kg)) for kg in LOADS_KG] == plain
    assert [one["ended"]["by"] for one in state["history"]] == ["office"] * 3
    assert [one["state"] for one in state["history"]] == ["ended"] * 3
    assert refusal(lambda: bench.service.take_back("office", first["id"])) == WeightRefusal.NO_SUCH_WEIGHT


def test_a_restart_goes_on_with_the_very_same_numbers(bench: KnownWeightBench) -> None:
    bench.empty()
    bench.ticket(0, 290.0)
    before, state = bits(bench.pipeline.shown(200.0)), bench.state()
    bench.restart()
    assert bits(bench.pipeline.shown(200.0)) == before
    assert bench.state()["history"] == state["history"]


def test_tares_are_taken_back_one_or_all_and_tickets_stay(bench: KnownWeightBench) -> None:
    ticket = bench.ticket(0, 280.0)
    tares = [bench.empty()["id"]]
    bench.pipeline.weigh(14.0)
    tares.append(bench.empty()["id"])
    bench.service.take_back_empty("office", to_factory=False)
    assert [one["ended"] is None for one in bench.state()["history"]] == [False, True, True]
    bench.service.take_back_empty("office", to_factory=True)
    ended = {one["id"]: one["ended"] and one["ended"]["why"] for one in bench.state()["history"]}
    assert ended == {tares[1]: "withdrawn", tares[0]: "back_to_factory", ticket["id"]: None}
    assert refusal(lambda: bench.service.take_back_empty("office", to_factory=True)) == WeightRefusal.NO_SUCH_WEIGHT


UNFIT: list[tuple[Callable[[KnownWeightBench], Any], WeightRefusal]] = [
    (lambda b: setattr(b.pipeline.flow, "weighed", None), WeightRefusal.NO_COUNTED_BATCH),
    (lambda b: setattr(b.pipeline, "age_s", None), WeightRefusal.NO_COUNTED_BATCH),
    (lambda b: setattr(b.pipeline, "age_s", 900.5), WeightRefusal.STALE),
    (lambda b: setattr(b.pipeline.flow, "load_may_have_changed", True), WeightRefusal.LOAD_MAY_HAVE_CHANGED),
]


@pytest.mark.parametrize(("spoil", "reason"), UNFIT)
def test_empty_now_needs_a_load_that_was_just_weighed(
    bench: KnownWeightBench, spoil: Callable[[KnownWeightBench], Any], reason: WeightRefusal
) -> None:
    spoil(bench)
    assert bench.state()["offer"] == bench.state()["offer"] | {"is_possible": False, "reason": reason, "load": None}
    assert refusal(bench.empty) == reason
    assert (bench.in_use, bench.state()["history"]) == (None, [])


def test_the_offer_is_the_load_that_empty_now_would_be_of(bench: KnownWeightBench) -> None:
    offer = bench.state()["offer"]
    made = bench.empty()
    assert offer["is_possible"] is True
    assert (offer["load"]["payload_kg"], offer["load"]["t_end"]) == (made["estimated_payload_kg"], made["t_end"])


def test_what_cannot_be_known_is_refused_and_leaves_no_trace(bench: KnownWeightBench) -> None:
    def ticket(stated: StatedWeight) -> str:
        return refusal(lambda: bench.service.add(KnownWeightKind.TICKET, "a", None, stated))

    assert ticket(bench.stated(0, 280.0, at="2020-01-01T00:00:00Z")) == WeightRefusal.NO_EPOCH
    assert ticket(bench.stated(0, 9000.0)) == WeightRefusal.IMPOSSIBLE_WEIGHT
    assert ticket(StatedWeight(bench.stated(0, 0.0).at, gross_kg=1500.0)) == WeightRefusal.NO_UNSPRUNG_MASS
    assert bench.state()["history"] == []
    bench.ticket(0, 280.0)
    assert ticket(bench.stated(0, 281.0)) == WeightRefusal.ALREADY_KNOWN
    bench.empty()
    assert refusal(bench.empty) == WeightRefusal.ALREADY_KNOWN


@pytest.mark.parametrize("kind", [KnownWeightKind.TICKET, KnownWeightKind.DELIVERY_NOTE])
def test_each_kind_has_its_usual_error_and_one_that_is_stated_goes_before(
    bench: KnownWeightBench, kind: KnownWeightKind
) -> None:
    usual = json.loads(bench.service.add(kind, "a", None, bench.stated(0, 280.0)))
    assert usual["payload_std_kg"] == STD_KG[kind]
    assert json.loads(bench.service.add(kind, "a", None, bench.stated(1, 400.0, std_kg=40.0)))["payload_std_kg"] == 40.0


def test_a_less_certain_weight_teaches_less(tmp_path: Path) -> None:
    stds = []
    for std_kg in (1.0, 20.0, 200.0):
        bench = KnownWeightBench(tmp_path / str(std_kg), *LOADS_KG)
        bench.ticket(0, 280.0, std_kg=std_kg)
        stds.append(bench.pipeline.shown(300.0).std(PAYLOAD))
        bench.store.close()
    assert stds == sorted(stds)
    assert stds[2] > stds[0] + 1.0


def test_without_a_calibration_there_is_nothing_to_condition(bench: KnownWeightBench) -> None:
    bench.restart(calibrated=None)
    assert refusal(bench.empty) == WeightRefusal.NO_CALIBRATION
    assert bench.state()["offer"]["reason"] == WeightRefusal.NO_CALIBRATION


def test_they_belong_to_their_calibration_and_estimator(bench: KnownWeightBench) -> None:
    bench.empty()
    in_use = bench.in_use
    bench.restart(calibrated=calibration_file(payload_kg=300.0).for_core())
    assert (bench.in_use, bench.state()["history"][0]["state"]) == (None, "other_calibration")
    assert refusal(lambda: bench.ticket(0, 280.0)) == WeightRefusal.OTHER_CALIBRATION
    bench.restart(estimator="cross_spectrum")
    assert bench.in_use is None
    bench.restart()
    assert bench.in_use == in_use


def test_standing_ones_are_never_forgotten_ended_ones_are(bench: KnownWeightBench) -> None:
    first = bench.ticket(0, 280.0)
    for _ in range(MOST_KNOWN_WEIGHTS + 5):
        bench.pipeline.weigh(12.0)
        bench.service.take_back("a", bench.empty()["id"])
    entries = bench.kept.entries
    assert len(entries) == MOST_KNOWN_WEIGHTS
    assert entries[0].id == first["id"]


def test_a_disk_that_refuses_leaves_all_as_it_was(bench: KnownWeightBench) -> None:
    made = bench.ticket(0, 280.0)
    path = bench.directory / FILE_NAME
    before, kept = bench.in_use, path.read_bytes()
    path.with_name(f".{FILE_NAME}.new").mkdir()  # no file can be written there, not even by root
    assert refusal(bench.empty) == WeightRefusal.NOT_STORED
    assert refusal(lambda: bench.service.take_back("b", made["id"])) == WeightRefusal.NOT_STORED
    assert (bench.in_use, path.read_bytes()) == (before, kept)


SPOILT: list[tuple[Callable[[str], str], str]] = [
    (lambda text: text.replace('"payload_kg": 280.0', '"payload_kg": 281.0'), "was changed after it was written"),
    (lambda text: text.replace('"version": 1', '"version": 2'), "version"),
    (lambda text: text[: len(text) // 2], "JSON"),
    (lambda text: "", "JSON"),
    (lambda text: "[" * 5000, "JSON"),
    (lambda text: '{"note": "\\ud83d"}', "JSON"),
    (lambda text: text.replace('"payload_std_kg": 5.0', '"payload_std_kg": NaN'), "payload_std_kg"),
]


@pytest.mark.parametrize(("spoil", "said"), SPOILT)
def test_a_file_that_cannot_be_believed_is_set_aside_and_the_weighing_goes_on(
    bench: KnownWeightBench, spoil: Callable[[str], str], said: str, caplog: pytest.LogCaptureFixture
) -> None:
    bench.ticket(0, 280.0)
    path = bench.directory / FILE_NAME
    spoilt = spoil(path.read_text())
    assert spoilt != path.read_text()
    path.write_text(spoilt)
    with pytest.raises(ConfigurationError, match=said) as fault:
        load_known_weights(path)
    assert str(path) in str(fault.value)
    assert "remove it to go on without known weights" in str(fault.value)
    bench.restart()
    assert bench.in_use is None
    (aside,) = bench.directory.glob(f"{FILE_NAME}.broken-*")
    assert aside.read_text() == spoilt
    assert aside.name in str(bench.service.fault)
    assert said in fields_of(caplog, Event.HISTORY_SET_ASIDE)["fault"]
    bench.empty()
    assert bench.service.fault is None


def test_a_broken_file_that_cannot_be_moved_is_not_written_over(
    bench: KnownWeightBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = bench.directory / FILE_NAME
    path.write_text("{")

    def refuse(_self: KeptFiles, _name: str) -> str:
        raise OSError(errno.EROFS, "Read-only file system")

    with monkeypatch.context() as patch:
        patch.setattr(KeptFiles, "set_aside", refuse)
        bench.restart()
        assert refusal(bench.empty) == WeightRefusal.NOT_STORED
        assert path.read_text() == "{"
    bench.empty()
    assert [aside.read_text() for aside in bench.directory.glob(f"{FILE_NAME}.broken-*")] == ["{"]


def test_the_log_tells_of_every_change(bench: KnownWeightBench, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    made = bench.ticket(0, 400.0)
    bench.service.confirm("office", made["id"])
    bench.service.take_back("office", made["id"])
    assert names(caplog) == [Event.WEIGHT_KNOWN, Event.WEIGHT_CONFIRMED, Event.WEIGHT_TAKEN_BACK]
    said = fields_of(caplog, Event.WEIGHT_KNOWN)
    assert (said["known_weight_id"], said["kind"], said["by"], said["is_held"]) == (
        made["id"],
        "ticket",
        "workshop",
        True,
    )


def test_the_list_as_it_stood_at_any_time_is_known(bench: KnownWeightBench) -> None:
    """What an archive is read by: entries, confirmations and ends count from their own moment on."""
    held = bench.ticket(0, 400.0)
    start_ns = bench.now_ns
    bench.service.confirm("a", held["id"])
    confirmed_ns = bench.now_ns
    bench.service.take_back("a", held["id"])

    def teaches(t_ns: int) -> bool:
        return bench.kept.as_of(t_ns).knowledge(CALIBRATED.id, "ratio_index") is not None

    moments = (start_ns, start_ns + 1, confirmed_ns, confirmed_ns + 1, bench.now_ns, bench.now_ns + 1)
    assert [teaches(t_ns) for t_ns in moments] == [False, False, False, True, True, False]


def test_a_load_is_judged_without_what_is_known_of_it(bench: KnownWeightBench) -> None:
    """A verification under a ticket of the same load must not praise the ticket."""
    at_ns = bench.pipeline.flow.weighed.t_end_ns
    epochs = epochs_around(bench.store.reader(), at_ns)
    of_ticket, other = epochs[0], epoch_at(epochs, epochs[1].t_end_ns, None)
    bench.ticket(0, 330.0)
    assert bench.service.payload_without(of_ticket).number == pytest.approx(276.0, abs=1e-6)
    assert bench.service.payload_without(other) == other.payload
