"""Statements, learning and the vehicle over HTTP: what is taken, what is answered, and who may."""

import json
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from support.learner import ANSWERS, LearnerBench, at, found
from support.learner import VEHICLE as VAN
from support.paper_van import paper_van
from support.web import Client, Gateway

from gateway.calibration.file import load_calibration
from gateway.stated.learning import SisterTold
from gateway.web.access.tokens import Scope, TokenFile

STATEMENTS = "/api/v1/statements"
LEARNING = "/api/v1/learning"
VEHICLE = "/api/v1/vehicle"
SISTER = f"{VEHICLE}/sister"
DEMO = Path(str(files("gateway"))) / "demo" / "paper_van.json"
NOTE: dict[str, Any] = {
    "from": at(0),
    "source": "delivery_note",
    "load": {"payload_kg": 310, "plus_minus_kg": 25},
    "ref": "LS-4711",
}
CSV = {"content-type": "text/csv; charset=utf-8"}


@pytest.fixture
def bench(tmp_path: Path) -> LearnerBench:
    return LearnerBench(tmp_path / "vehicle")


@pytest.fixture
def local(tmp_path: Path, bench: LearnerBench) -> Iterator[Client]:
    with Gateway(tmp_path / "store", learner=bench.learner) as gateway:
        yield Client(gateway.app)


def post(client: Client, body: Any = NOTE) -> dict[str, Any]:
    answer = client.request("POST", STATEMENTS, json=body)
    assert answer.status_code == 201, answer.text
    told: dict[str, Any] = answer.json()
    return told


def listed(client: Client, query: str = "") -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = client.get(STATEMENTS + query).json()["items"]
    return items


@pytest.mark.parametrize("moment", ["0001-01-01T00:00:00+14:00", "1969-12-31T23:59:59Z", "9999-12-31T23:59:59.9Z"])
@pytest.mark.parametrize("bound", ["from", "until"])
def test_a_year_in_which_nobody_drives_is_refused(local: Client, bound: str, moment: str) -> None:
    """One was stored, and from then on no statement was answered."""
    local.request("PUT", VEHICLE, json=ANSWERS)
    answer = local.request("POST", STATEMENTS, json=NOTE | {bound: moment})
    assert answer.status_code == 422
    assert f"{bound}: not a year of a drive" in answer.json()["detail"]
    table = f"from;until;payload_kg\n{NOTE['from'] if bound == 'until' else moment};{moment};310\n"
    assert "not a year of a drive" in local.request("POST", STATEMENTS, content=table, headers=CSV).text
    assert listed(local) == []


def test_a_statement_comes_before_its_drive_and_waits_for_it(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    told = post(local)
    assert (told["state"], told["found"], told["by"]) == ("waiting", None, "local")
    assert "no drive within 12 hours" in told["reason"]
    bench.drive(60)
    assert "next fit" in listed(local)[0]["reason"]
    bench.turn()
    bench.finish(**found(bench, "used"))
    one = listed(local)[0]
    assert (one["state"], one["found"]) == ("used", {"payload_kg": 298.0, "plus_minus_kg": 40.0})
    assert one["drives"] == [at(0)]
    assert one["load"]["payload_kg"] == 310.0


def test_a_statement_without_a_vehicle_waits_and_names_what_is_missing(local: Client) -> None:
    assert "vehicle is not known yet" in post(local)["reason"]
    assert local.get(LEARNING).json()["lacks"] == ["vehicle", "drives"]


def test_the_same_statement_twice_counts_once(local: Client) -> None:
    assert post(local)["id"] == post(local)["id"]
    assert len(listed(local)) == 1


def test_a_later_statement_with_the_same_ref_replaces(local: Client) -> None:
    first = post(local)
    post(local, {**NOTE, "load": {"payload_kg": 280}})
    states = {one["id"]: (one["state"], one["load"]["payload_kg"]) for one in listed(local)}
    assert states.pop(first["id"]) == ("withdrawn", 310.0)
    assert list(states.values()) == [("waiting", 280.0)]


def test_a_withdrawn_statement_stays_in_the_list_and_may_be_stated_anew(local: Client) -> None:
    one = post(local)
    gone = local.request("DELETE", f"{STATEMENTS}/{one['id']}").json()
    assert gone["state"] == "withdrawn"
    again = local.request("DELETE", f"{STATEMENTS}/{one['id']}")
    assert (again.status_code, again.json()["reason"]) == (409, "withdrawn")
    assert local.request("POST", f"{STATEMENTS}/{one['id']}/confirm").status_code == 409
    assert post(local)["state"] == "waiting"
    assert len(listed(local)) == 1


def test_a_held_statement_is_asked_about_until_somebody_confirms_it(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    one = post(local)
    bench.drive(60)
    bench.turn()
    bench.finish(**found(bench, "held", 120.0, "says 310 kg, the drive shows 120 ± 40 kg: is it of another drive?"))
    question = local.get(LEARNING).json()["questions"][0]
    assert (question["kind"], question["statement_id"]) == ("held", one["id"])
    assert question["text"].startswith("LS-4711: says 310 kg")
    confirmed = local.request("POST", f"{STATEMENTS}/{one['id']}/confirm").json()
    assert (confirmed["confirmed"], confirmed["state"]) == (True, "waiting")
    assert local.get(LEARNING).json()["questions"] == []
    bench.turn()
    assert bench.worker.job is not None
    assert bench.worker.job.records[0].confirmed


def test_drives_that_look_empty_are_proposed_and_never_taken(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    bench.drive(0)
    bench.turn()
    drives = ({"number": 1, "t_start": at(0), "t_end": at(300)},)
    bench.finish(drives=drives, looks_empty=(1,))
    question = local.get(LEARNING).json()["questions"][0]
    assert question["kind"] == "looks_empty"
    assert "Is that right?" in question["text"]
    assert listed(local) == []
    answer = post(local, question["propose"])
    assert (answer["n_rows"], answer["n_match"]) == (1, 1)
    assert answer["items"][0]["load"]["payload_kg"] == 0.0


def test_a_denied_proposal_is_not_made_again(local: Client, bench: LearnerBench) -> None:
    """Another fit, a restart or another cut of the drive does not ask again; another drive is asked about."""
    local.request("PUT", VEHICLE, json=ANSWERS)
    bench.drive(0)
    bench.turn()
    drives = tuple({"number": n + 1, "t_start": at(600 * n), "t_end": at(600 * n + 300)} for n in range(2))
    bench.finish(drives=drives, looks_empty=(1, 2))
    first, second = (one["from"] for one in local.get(LEARNING).json()["questions"][0]["propose"])
    (question,) = local.request("PUT", LEARNING, json={"not_empty": [first]}).json()["questions"]
    assert [one["from"] for one in question["propose"]] == [second]
    assert local.request("PUT", LEARNING, json={"not_empty": [first]}).status_code == 404
    assert local.request("PUT", LEARNING, json={"not_empty": [second], "use": "newest"}).status_code == 422
    bench.drive(3600)
    bench.turn()
    assert bench.worker.job is not None
    assert [end_ns - begin_ns for begin_ns, end_ns in bench.worker.job.laden] == [300 * 10**9]
    cut = ({"number": 1, "t_start": at(100), "t_end": at(300)}, {"number": 2, "t_start": at(600), "t_end": at(900)})
    bench.finish(drives=cut, looks_empty=(1, 2))
    again = LearnerBench(bench.directory)
    (question,) = json.loads(again.learner.learnt.state())["questions"]
    assert [one["from"] for one in question["propose"]] == [second]


def test_the_import_reports_the_state_of_each_row(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    bench.drive(0)
    bench.drive(3600)
    rows = [
        "vehicle;from;until;payload_kg;ref",
        f"van-17;{at(0)};{at(300)};310,5;A",
        f"van-17;{at(3600)};{at(3900)};120;B",
        f"van-17;{at(90_000)};;200;C",
        f"van-18;{at(0)};;200;D",
        "van-17;yesterday;;200;E",
    ]
    table = "\n".join(rows).encode()
    dry = local.request("POST", f"{STATEMENTS}?dry_run=true", content=table, headers=CSV)
    assert dry.status_code == 200
    told = "5 rows: 2 match a drive, 1 waits, 1 unknown vehicle (row 5), 1 bad (row 6)"
    assert dry.json()["text"] == told
    assert dry.json()["items"] == listed(local) == []
    real = local.request("POST", STATEMENTS, content=table, headers=CSV)
    assert (real.status_code, real.json()["text"]) == (201, told)
    assert [one["ref"] for one in real.json()["items"]] == ["A", "B", "C"]
    assert {one["ref"] for one in listed(local)} == {"A", "B", "C"}
    again = local.request("POST", STATEMENTS, content=table, headers=CSV)
    assert again.json()["text"] == told
    assert len(listed(local)) == 3


def test_times_of_a_table_are_in_the_zone_that_is_named(local: Client) -> None:
    table = b"from;payload_kg\n26.11.2026 08:40;310\n"
    local.request("POST", f"{STATEMENTS}?timezone=Europe/Berlin", content=table, headers=CSV)
    assert listed(local)[0]["from"] == "2026-11-26T08:40:00+01:00"
    for zone, why in (("Europe/Atlantis", "no zone is called"), ("localtime", "another zone on every computer")):
        refused = local.request("POST", f"{STATEMENTS}?timezone={zone}", content=table, headers=CSV)
        assert refused.status_code == 422
        assert zone in refused.json()["detail"]
        assert why in refused.json()["detail"]


@pytest.mark.parametrize(
    ("body", "what"),
    [
        ({**NOTE, "load": {"payload_kg": 310, "gross_kg": 1700}}, "says the load twice"),
        ({**NOTE, "load": {}}, "says no load"),
        ({**NOTE, "source": "guess"}, "source"),
        ({**NOTE, "from": "2026-11-26T07:40:00"}, "from"),
        ({**NOTE, "until": at(-10)}, "until is not after from"),
        ({**NOTE, "kilograms": 3}, "kilograms"),
    ],
)
def test_an_empty_statement_is_refused_with_a_sentence(local: Client, body: dict[str, Any], what: str) -> None:
    answer = local.request("POST", STATEMENTS, json=body)
    assert answer.status_code == 422
    assert what in answer.json()["detail"]
    assert listed(local) == []


def test_text_that_is_no_table_is_refused(local: Client) -> None:
    answer = local.request("POST", STATEMENTS, content=b"hello", headers=CSV)
    assert (answer.status_code, answer.json()["reason"]) == (422, "unreadable")
    assert local.request("POST", STATEMENTS, content=b"x", headers={"content-type": "image/png"}).status_code == 415
    assert local.request("POST", STATEMENTS, json=[{"from": at(0)}]).status_code == 422


def test_an_id_belongs_to_one_statement(local: Client) -> None:
    post(local, {**NOTE, "id": "mine"})
    taken = local.request("POST", STATEMENTS, json={**NOTE, "id": "mine", "load": {"payload_kg": 1}})
    assert (taken.status_code, taken.json()["reason"]) == (409, "id_taken")
    assert local.request("DELETE", f"{STATEMENTS}/other").status_code == 404


def test_the_list_has_pages_and_filters(local: Client) -> None:
    for i in range(5):
        post(local, {**NOTE, "ref": str(i), "from": at(3600 * i)})
    page = local.get(f"{STATEMENTS}?limit=2").json()
    assert [one["ref"] for one in page["items"]] == ["4", "3"]
    rest = local.get(f"{STATEMENTS}?limit=9&cursor={page['next_cursor']}").json()
    assert ([one["ref"] for one in rest["items"]], rest["next_cursor"]) == (["2", "1", "0"], None)
    assert [one["ref"] for one in listed(local, f"?since={at(3600 * 3)}")] == ["4", "3"]
    assert listed(local, "?state=used") == []
    assert local.get(f"{STATEMENTS}?state=lost").status_code == 422


def test_the_vehicle_is_one_form_and_unlikely_figures_are_asked_about(local: Client, bench: LearnerBench) -> None:
    bench.drive(0)
    pounds = {**ANSWERS, "kerb_front_axle_kg": 1521.0, "kerb_rear_axle_kg": 1565.0, "gross_limit_kg": 4400.0}
    told = local.request("PUT", VEHICLE, json=pounds).json()["stated"]
    assert told["doubts"][0]["kind"] == "mass"
    assert local.get(LEARNING).json()["lacks"] == ["confirmed_vehicle"]
    bench.turn()
    assert bench.worker.job is None
    sure = local.request("PUT", f"{VEHICLE}?confirm=true", json=pounds).json()["stated"]
    assert sure["is_confirmed"]
    bench.turn()
    assert bench.worker.job is not None
    assert bench.worker.job.vehicle.payload_range_kg == (0.0, 4400.0 - 1521.0 - 1565.0)
    assert local.get(VEHICLE).json()["stated"]["figures"]["gross_limit_kg"] == 4400.0


def test_a_vehicle_that_cannot_be_is_refused(local: Client) -> None:
    answer = local.request("PUT", VEHICLE, json={**ANSWERS, "kerb_front_axle_kg": 20.0})
    assert (answer.status_code, answer.json()["reason"]) == (409, "vehicle_unusable")
    assert local.request("PUT", VEHICLE, json={"wheelbase_m": 2.7}).status_code == 422
    assert local.get(VEHICLE).json()["stated"] is None


def test_learning_begins_with_the_file_of_a_vehicle_of_the_same_model(local: Client, bench: LearnerBench) -> None:
    alike = load_calibration(DEMO)
    local.request("PUT", VEHICLE, json={**ANSWERS, "wheelbase_m": alike.vehicle.wheelbase_m})
    bench.drive(0)
    bench.turn()
    alone = bench.worker.job
    assert alone is not None
    assert alone.like is None
    bench.finish()
    assert local.request("PUT", SISTER, content=DEMO.read_bytes()).json()["sister"] == {
        "name": alike.vehicle.name,
        "calibration_id": alike.id,
    }
    bench.turn()
    like = bench.worker.job
    assert like is not None
    assert like.like is not None
    assert like.key != alone.key
    assert load_calibration(like.like).id == alike.id
    bench.finish()
    again = LearnerBench(bench.directory)  # after a restart
    assert again.learner.van.sister() == SisterTold(name=alike.vehicle.name, calibration_id=alike.id)
    assert local.request("DELETE", SISTER).json()["sister"] is None
    bench.turn()
    assert bench.worker.job is not None
    assert bench.worker.job.key == alone.key
    assert list(bench.directory.glob("sister-*")) == []


def test_a_file_that_is_no_calibration_of_this_model_is_refused(local: Client) -> None:
    for content in (b"", b"[]", b"{}", b'{"format": "springscale-calibration", "version": 99}', b"\xff"):
        answer = local.request("PUT", SISTER, content=content)
        assert (answer.status_code, answer.json()["reason"]) == (422, "unreadable")
    local.request("PUT", VEHICLE, json={**ANSWERS, "wheelbase_m": 3.4})
    answer = local.request("PUT", SISTER, content=DEMO.read_bytes())
    assert (answer.status_code, answer.json()["reason"]) == (409, "not_its_sister")
    assert local.get(VEHICLE).json()["sister"] is None


def test_every_version_is_kept_explained_and_may_be_chosen(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    bench.drive(0)
    bench.turn()
    bench.finish(62.0, 200.0, drives=({"number": 1, "t_start": at(0), "t_end": at(300)},))
    bench.drive(3600)
    bench.turn()
    drives = tuple({"number": n, "t_start": at(3600 * n), "t_end": at(3600 * n + 300)} for n in (1, 2))
    bench.finish(34.0, 210.0, drives=drives)
    state = local.get(LEARNING).json()
    newest, first = state["versions"]
    assert newest["text"] == "2 drives and 0 statements: ± 62 kg became ± 34 kg"
    assert (newest["state"], first["state"], state["takes_effect"]) == ("next_drive", "earlier", "next_drive")
    assert (state["plus_minus_kg"], state["tested_on"]) == (34.0, 3)
    back = local.request("PUT", LEARNING, json={"use": first["id"]}).json()
    assert [one["state"] for one in back["versions"]] == ["earlier", "next_drive"]
    assert local.request("PUT", LEARNING, json={"use": "file"}).json()["takes_effect"] is None
    assert local.request("PUT", LEARNING, json={"use": "newest"}).json()["versions"][0]["state"] == "next_drive"
    assert local.request("PUT", LEARNING, json={"use": "sha256:none"}).status_code == 404


def test_a_version_that_predicts_worse_is_kept_and_not_used(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    bench.drive(0)
    bench.turn()
    bench.finish(62.0, worse="it predicts the loads of 3 drives worse")
    state = local.get(LEARNING).json()
    assert (state["versions"][0]["state"], state["takes_effect"]) == ("worse", None)
    assert "predicts the loads" in state["versions"][0]["text"]


def test_a_box_that_moves_to_another_vehicle_is_told(local: Client, bench: LearnerBench, tmp_path: Path) -> None:
    """It would weigh the other vehicle by the springs of the first; who only corrects the id states it again."""
    local.request("PUT", VEHICLE, json=ANSWERS)
    moved = LearnerBench(bench.directory, replace(VAN, id="van-18"))
    with Gateway(tmp_path / "moved", learner=moved.learner) as gateway:
        client = Client(gateway.app)
        assert "learnt is of van-17, and [vehicle] id is van-18" in client.get(LEARNING).json()["fault"]
        client.request("PUT", VEHICLE, json=ANSWERS)
        assert client.get(LEARNING).json()["fault"] is None
    assert LearnerBench(bench.directory, replace(VAN, id="van-18")).learner.fault is None


def test_a_sister_of_another_model_in_the_settings_is_told(local: Client, bench: LearnerBench) -> None:
    """The service learnt nothing, and asked to confirm a vehicle about which it had no question."""
    local.request("PUT", VEHICLE, json=ANSWERS)
    sister = paper_van(wheelbase_m=3.3)
    fault = LearnerBench(bench.directory, replace(VAN, sister=sister)).learner.fault
    assert str(fault).startswith("nothing is learnt: ")
    assert "another model; give the calibration of a vehicle of its own model" in str(fault)


def test_statements_are_kept_while_learning_is_off(tmp_path: Path) -> None:
    bench = LearnerBench(tmp_path / "vehicle", replace(VAN, why_not_allowed="calibrations come by file"))
    with Gateway(tmp_path / "store", learner=bench.learner) as gateway:
        client = Client(gateway.app)
        refused = client.request("PUT", VEHICLE, json=ANSWERS)
        assert (refused.status_code, refused.json()["reason"]) == (403, "not_allowed")
        assert post(client)["state"] == "waiting"
        assert client.get(LEARNING).json()["why_not"] == "calibrations come by file"


def test_reading_needs_a_token_to_read_and_stating_one_to_operate(tmp_path: Path, bench: LearnerBench) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    read, operate = (tokens.create(scope.value, scope) for scope in (Scope.READ, Scope.OPERATE))
    with Gateway(tmp_path / "store", tokens=tokens, learner=bench.learner) as gateway:
        client = Client(gateway.app)

        def status(method: str, url: str, token: str | None, **body: Any) -> int:
            headers = {} if token is None else {"Authorization": f"Bearer {token}"}
            return client.request(method, url, headers=headers, **body).status_code

        assert status("GET", STATEMENTS, None) == 401
        assert status("GET", LEARNING, read) == status("GET", STATEMENTS, read) == 200
        assert status("POST", STATEMENTS, read, json=NOTE) == 403
        assert status("PUT", VEHICLE, read, json=ANSWERS) == 403
        assert status("POST", STATEMENTS, operate, json=NOTE) == 201
    assert json.loads(bench.learner.loads.page())["items"][0]["by"] == "operate"


def test_everything_is_on_disk_when_answered(local: Client, bench: LearnerBench) -> None:
    local.request("PUT", VEHICLE, json=ANSWERS)
    one = post(local)
    again = LearnerBench(bench.directory)  # as after a power cut
    assert json.loads(again.learner.loads.page())["items"][0]["id"] == one["id"]
    assert again.learner.van.told() is not None
