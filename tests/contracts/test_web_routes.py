"""The routes as the contract has them, asked through the real application over a real store."""

from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families
from support.estimates import make_estimate, make_record, texts
from support.patience import PATIENCE_S
from support.web import Client, Gateway

from gateway.records import Why
from gateway.status import LOOK, BatchCounts, BusStatus, DecodeCount, SignalHealth, State, Status, StoreStatus, judged

JSON = "application/json"


def test_latest_is_the_estimate_with_its_age(gateway: Gateway, client: Client) -> None:
    before = client.get("/api/v1/estimates/latest")
    assert (before.status_code, before.headers["content-type"]) == (200, JSON)
    assert (before.json()["rejected"], before.json()["payload_kg"]) == (["no_estimate_yet"], None)
    gateway.publish(make_estimate(5, with_spectra=True))
    gateway.clock_s += 7.0
    of_now = {"age_s": 7.0, "is_stale": False, "is_stored": True, "last_rejection": None}
    assert client.get("/api/v1/estimates/latest").json() == make_record(5, with_spectra=True) | of_now


def test_an_unchanged_latest_is_not_sent_again(gateway: Gateway, client: Client) -> None:
    gateway.publish(make_estimate(5))
    etag = client.get("/api/v1/estimates/latest").headers["etag"]
    for named in (etag, f'"other", {etag}', etag.removeprefix("W/"), "*"):
        again = client.get("/api/v1/estimates/latest", headers={"if-none-match": named})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
    assert client.request("HEAD", "/api/v1/estimates/latest", headers={"if-none-match": etag}).status_code == 304
    gateway.publish(make_estimate(6))
    assert client.get("/api/v1/estimates/latest", headers={"if-none-match": etag}).status_code == 200


def test_the_history_is_the_stored_text_page_by_page(gateway: Gateway, client: Client) -> None:
    records = [make_record(n, *([Why.GAP] if n % 2 else [])) for n in range(5)]
    gateway.publish(*(make_estimate(n, *([Why.GAP] if n % 2 else [])) for n in range(5)))
    first = client.get("/api/v1/estimates", params={"limit": 3})
    assert first.text.startswith('{"items":[' + ",".join(texts(*records[:3])) + '],"next_cursor":"')
    second = client.get("/api/v1/estimates", params={"limit": 3, "cursor": first.json()["next_cursor"]}).json()
    assert second["items"] == records[3:]
    assert second["next_cursor"] is None
    gateway.publish(make_estimate(9))
    tail = client.get("/api/v1/estimates", params={"cursor": second["last_cursor"]}).json()
    assert tail["items"] == [make_record(9)]


def test_the_history_comes_newest_first_and_without_spectra_on_request(gateway: Gateway, client: Client) -> None:
    gateway.publish(make_estimate(0, with_spectra=True), make_estimate(1, with_spectra=True))
    answer = client.get("/api/v1/estimates", params={"order": "newest_first", "spectra": "false"}).json()
    assert answer["items"] == [make_record(1), make_record(0)]


def test_the_history_can_be_cut_by_time(gateway: Gateway, client: Client) -> None:
    gateway.publish(*(make_estimate(n) for n in range(4)))  # they end at 00:05, 00:10, 00:15, 00:20
    span = {"since": "1970-01-01T01:10:00+01:00", "until": "1970-01-01T00:20:00Z"}
    assert client.get("/api/v1/estimates", params=span).json()["items"] == [make_record(1), make_record(2)]
    ages = {"since": "0001-01-01T00:00:00Z", "until": "9999-12-31T23:59:59Z"}
    assert len(client.get("/api/v1/estimates", params=ages).json()["items"]) == 4


@pytest.mark.parametrize(
    ("query", "where"),
    [
        ("limit=0", "query.limit"),
        ("limit=1001", "query.limit"),
        ("limit=many", "query.limit"),
        ("since=yesterday", "query.since"),
        ("until=2026-11-21", "query.until"),
        ("cursor=nonsense", "query.cursor"),
        ("cursor=" + "a" * 65, "query.cursor"),
        ("order=sideways", "query.order"),
        ("sinc=2026-11-21T00:00:00Z", "query.sinc"),
    ],
)
def test_an_invalid_parameter_is_a_problem_that_names_it(client: Client, query: str, where: str) -> None:
    answer = client.get(f"/api/v1/estimates?{query}")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert [fault["where"] for fault in answer.json()["errors"]] == [where]
    assert where in answer.json()["detail"]


def test_a_missing_resource_is_a_problem(client: Client) -> None:
    for path in ("/api/v1/nothing", "/assets/nothing.js", "/assets/../app.py", "/swagger/%2e%2e/core.py", "/health"):
        answer = client.get(path)
        assert answer.status_code == 404, path
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json()["status"] == 404
    answer = client.request("DELETE", "/api/v1/status")
    assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD")
    assert answer.json()["title"] == "Method Not Allowed"


def test_a_problem_says_how_to_mend_the_query(client: Client) -> None:
    assert "send a next_cursor or last_cursor" in client.get("/api/v1/estimates?cursor=nonsense").json()["detail"]
    assert "query.sinc: unknown here" in client.get("/api/v1/estimates?sinc=x").json()["detail"]
    form = client.request("PUT", "/api/v1/learning", content=b"use=newest")
    assert form.json()["detail"] == "body: send a JSON object, with Content-Type: application/json"
    broken = client.request("POST", "/api/v1/statements", content=b"{", headers={"Content-Type": JSON})
    assert broken.json()["errors"] == [{"where": "body", "what": "this is no JSON"}]


@pytest.mark.parametrize(
    "path",
    [
        *("/", "/assets/icon.svg", "/health/ready"),
        *(f"/api/v1/{name}" for name in ("estimates/latest", "export.csv", "stream", "nothing")),
    ],
)
def test_head_is_answered_as_get_without_the_body(gateway: Gateway, client: Client, path: str) -> None:
    gateway.publish(make_estimate(0))
    head = client.request("HEAD", path)
    gateway.board.close()  # so that the stream ends for GET
    asked = client.get(path)
    assert head.content == b""
    assert asked.content
    for answer in (head, asked):
        del answer.headers["date"]  # a second may pass between the two
    assert (head.status_code, head.headers) == (asked.status_code, asked.headers)


def test_an_unforeseen_error_is_a_problem_without_its_inside(gateway: Gateway, client: Client) -> None:
    del gateway.status
    answer = client.get("/api/v1/status")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert "AttributeError" not in answer.text
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_store_that_cannot_be_read_is_503(gateway: Gateway, client: Client, tmp_path: Path) -> None:
    gateway.publish(make_estimate(0))
    assert gateway.store.flush(PATIENCE_S)
    gateway.store.close()
    (tmp_path / "springscale.db").write_bytes(b"no database at all" * 1000)
    answer = client.get("/api/v1/estimates")
    assert answer.status_code == 503
    assert "cannot be read" in answer.json()["detail"]


def test_status_has_sentences_and_numbers(gateway: Gateway, client: Client) -> None:
    now = Status(
        version="1.2.3",
        state=State.READER_FAULT,
        uptime_s=1.0,
        calibration_id="sha256:ab",
        bus=BusStatus(interface="socketcan", channel="can0", state="reader_fault", last_fault="can0: no such device"),
        store=StoreStatus(state="degraded", reason="disk full", n_held=3),
    )
    gateway.status = judged(now, ())
    told = client.get("/api/v1/status").json()
    assert told["state"] == "reader_fault"
    assert "can0: no such device" in told["state_in_words"]
    assert "disk full" in told["state_in_words"]
    assert told["store"]["n_held"] == 3


def test_a_silent_sensor_is_named() -> None:
    heard = {"speed": 0.2, "vertical_acceleration": 75.0, "pitch_rate": None}
    signals = tuple(SignalHealth(signal=name, last_age_s=age_s) for name, age_s in heard.items())
    told = Status(version="1", state=State.SENSOR_FAULT, uptime_s=90.0, calibration_id="sha256:ab", signals=signals)
    said = "The bus is alive, but a sensor gives no valid sample. Missing: vertical acceleration, pitch rate."
    assert told.state_in_words == f"{said} {LOOK}"


def test_ready_follows_the_service(gateway: Gateway, client: Client) -> None:
    assert client.get("/health/ready").json() == {"is_ready": True, "state": "collecting", "warnings": []}
    gateway.status = gateway.status.model_copy(update={"is_ready": False, "not_ready_reason": "the bus is silent"})
    answer = client.get("/health/ready")
    assert (answer.status_code, answer.json()["detail"]) == (503, "the bus is silent")
    assert client.get("/health/live").json() == {"is_alive": True}


def test_metrics_can_be_parsed_and_follow_the_status(gateway: Gateway, client: Client) -> None:
    gateway.publish(make_estimate(20))
    gateway.status = Status(
        version="1.2.3",
        state=State.ESTIMATING,
        uptime_s=60.0,
        bus=BusStatus(n_frames=1234, n_inbox_dropped=5, n_kernel_dropped=6),
        decode=(DecodeCount(signal="speed", reason="not_valid", n=7),),
        signals=(SignalHealth(signal="speed", rate_hz=5.0),),
        batches=BatchCounts(n_estimates=1, n_rejected=2, rejected_by_reason={"gap": 2}),
    )
    answer = client.get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain")
    families = list(text_string_to_metric_families(answer.text))
    samples = {(s.name, *sorted(s.labels.values())): s.value for family in families for s in family.samples}
    assert all(family.name.startswith("springscale_") and family.documentation for family in families)
    assert samples["springscale_estimate_payload_kg",] == 120.0
    assert samples["springscale_estimate_is_stale",] == 0.0
    assert samples["springscale_bus_n_frames",] == 1234
    assert samples["springscale_bus_n_kernel_dropped",] == 6
    assert samples["springscale_decode_n", "not_valid", "speed"] == 7
    assert samples["springscale_signals_rate_hz", "speed"] == 5.0
    assert samples["springscale_batches_rejected_by_reason_gap",] == 2
    assert samples["springscale_state", "estimating"] == 1
    assert ("springscale_bus_last_fault",) not in samples


def test_unknown_quantities_have_no_metric(client: Client) -> None:
    text = client.get("/metrics").text
    for name in ("estimate_payload_kg", "estimate_age_s", "bus_last_frame_age_s"):
        assert f"springscale_{name}" not in text


@pytest.mark.parametrize("path", ["/", "/api/v1/estimates/latest", "/api/v1/status", "/nothing", "/openapi.json"])
def test_every_answer_carries_the_security_headers(client: Client, path: str) -> None:
    headers = client.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["cache-control"] in ("no-store", "no-cache")


def test_the_description_covers_the_contract_with_units_and_examples(client: Client) -> None:
    described = client.get("/openapi.json").json()
    assert described["openapi"].startswith("3.1")
    paths = (
        "/api/v1/estimates/latest /api/v1/estimates /api/v1/status /api/v1/stream /health/live /health/ready /metrics"
    )
    assert set(described["paths"]) >= set(paths.split())
    problem = described["paths"]["/api/v1/estimates"]["get"]["responses"]["422"]["content"]
    assert list(problem) == ["application/problem+json"]
    estimate = described["components"]["schemas"]["Estimate"]["properties"]
    assert set(make_record(0, with_spectra=True)) <= set(estimate)
    assert all(estimate[name].get("examples") for name in make_record(0))


def test_a_405_does_not_build_the_openapi_document(gateway: Gateway, client: Client) -> None:
    """The first 405 built the OpenAPI document in the event loop: nobody was answered for 0.9 s."""
    answer = client.request("DELETE", "/api/v1/statements")
    assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD, POST")
    assert client.request("POST", "/cab").headers["allow"] == "GET, HEAD"
    assert gateway.app.openapi_schema is None
