"""Alarms and events pushed to a web address, signed: from the same outbox as MQTT, at least once and in order.

The form is that of Standard Webhooks (docs/adr/webhook-by-the-standard-library.md).
"""

from gateway.uplink.webhook.receiver import Answer, Receiver, Verdict
from gateway.uplink.webhook.settings import WebhookSettings, webhook_settings
from gateway.uplink.webhook.signature import SecretError, secrets_of, signed
from gateway.uplink.webhook.webhook import Webhook

__all__ = [
    "Answer",
    "Receiver",
    "SecretError",
    "Verdict",
    "Webhook",
    "WebhookSettings",
    "secrets_of",
    "signed",
    "webhook_settings",
]
