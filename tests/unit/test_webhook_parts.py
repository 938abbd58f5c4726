"""What a webhook signs, how it reads answers, and which settings it refuses."""

import base64
import json
import textwrap
import time
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from support.receiver import SECRET, SECRET_TEXT

from gateway.config import VehicleSection
from gateway.config.sections import WebhookSection
from gateway.errors import ConfigurationError
from gateway.records import json_line
from gateway.uplink.outbox import OutboxMessage
from gateway.uplink.settings import secrets_of, webhook_settings
from gateway.uplink.webhook import body_of, signed

VAN = VehicleSection(id="van-17")


def test_the_signature_is_that_of_the_specification() -> None:
    """The example that Standard Webhooks' own libraries are tested with."""
    (secret,) = secrets_of("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw")
    headers = signed((secret,), "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, b'{"test": 2432232314}')
    assert headers == {
        "webhook-id": "msg_p5jXN8AQM9LWM0D4loKWxJek",
        "webhook-timestamp": "1614265330",
        "webhook-signature": "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=",
    }


def test_an_older_secret_signs_too() -> None:
    new, old = secrets_of(f"{SECRET_TEXT}\n{base64.b64encode(b'x' * 24).decode()}\n")
    both = signed((new, old), "a-1", 1, b"{}")["webhook-signature"].split(" ")
    assert both == [signed((one,), "a-1", 1, b"{}")["webhook-signature"] for one in (new, old)]
    assert new == SECRET


@pytest.mark.parametrize("text", ["", "whsec_", "whsec_not base64", base64.b64encode(b"short").decode(), "ü"])
def test_an_invalid_secret_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"empty|base64|bytes"):
        secrets_of(text)


def test_the_body_has_type_and_time() -> None:
    record = {"id": "event-5-a", "revision": 2, "t_end": "2026-11-22T08:00:00.000000Z"}
    message = OutboxMessage("e-1", "event-5-a-2", json_line(record), "events", kind="event")
    assert json.loads(body_of(message)) == {"type": "event", "timestamp": record["t_end"], "data": record}
    active = {"t_start": "2026-11-22T08:00:00.000000Z", "t_end": None}
    message = OutboxMessage("e-1", "alarm-5-a-1", json_line(active), "alarms/overload/gross", kind="alarm")
    assert json.loads(body_of(message))["timestamp"] == "2026-11-22T08:00:00.000000Z"


@pytest.fixture
def secret_file(tmp_path: Path) -> Path:
    path = tmp_path / "secret"
    path.write_text(SECRET_TEXT + "\n")
    return path


def test_an_address_in_its_parts(secret_file: Path) -> None:
    section = WebhookSection(url="https://fleet.example:8443/hooks/van?key=abc", secret_file=secret_file)
    settings = webhook_settings(section, VAN)
    assert (settings.receiver, settings.url) == ("https://fleet.example:8443", section.url)
    assert settings.kinds == ("alarm", "event")
    assert "abc" not in settings.queue
    assert webhook_settings(WebhookSection(), VAN) is None
    elsewhere = webhook_settings(section.model_copy(update={"url": "https://fleet.example:8443/other"}), VAN)
    assert elsewhere.queue != settings.queue


@pytest.mark.parametrize(
    "url",
    [
        "http://fleet.example/hook",
        "ftp://fleet.example",
        "fleet.example",
        "https://",
        "https://u:p@fleet.example/",
        "https://fleet.example/#here",
        "https://fleet.example:99999/",
        "https://fleet.example/a b",
        "https://flöte.example/",
    ],
)
def test_addresses_that_cannot_be_meant(url: str, secret_file: Path) -> None:
    with pytest.raises(ValidationError):
        WebhookSection(url=url, secret_file=secret_file)


def test_an_unusable_secret_is_reported_at_the_start(tmp_path: Path, secret_file: Path) -> None:
    section = WebhookSection(url="https://fleet.example/", secret_file=tmp_path / "none")
    with pytest.raises(ConfigurationError, match=r"secret_file .* cannot be used: .*openssl rand"):
        webhook_settings(section, VAN)
    section = WebhookSection(url="https://fleet.example/", secret_file=secret_file, ca=tmp_path / "none.pem")
    with pytest.raises(ConfigurationError, match=r"ca .* cannot be used"):
        webhook_settings(section, VAN)


def test_a_vehicle_without_a_name_is_refused(secret_file: Path) -> None:
    section = WebhookSection(url="https://fleet.example/", secret_file=secret_file)
    with pytest.raises(ConfigurationError, match="set \\[vehicle\\] id"):
        webhook_settings(section, VehicleSection())


def test_the_check_in_the_document_believes_what_is_signed_and_nothing_else() -> None:
    page = (Path(__file__).parents[2] / "docs/uplink.md").read_text()
    block = page[page.index("    import base64") : page.index("**To change the secret**")]
    known: dict[str, Any] = {}
    exec(textwrap.dedent(block), known)
    check, now_s, body = known["is_from_our_vehicle"], int(time.time()), b'{"type": "alarm"}'
    headers = signed(secrets_of(SECRET_TEXT), "alarm-5-a-1", now_s, body)
    assert check(headers, body, SECRET_TEXT)
    assert not check(headers, body + b" ", SECRET_TEXT)
    assert not check({**headers, "webhook-id": "alarm-5-a-2"}, body, SECRET_TEXT)
    assert not check(headers, body, "whsec_" + base64.b64encode(b"x" * 32).decode())
    assert not check(signed(secrets_of(SECRET_TEXT), "alarm-5-a-1", now_s - 400, body), body, SECRET_TEXT)
    older = secrets_of(f"{base64.b64encode(b'x' * 32).decode()}\n{SECRET_TEXT}")
    assert check(signed(older, "alarm-5-a-1", now_s, body), body, SECRET_TEXT)  # while it is changed
