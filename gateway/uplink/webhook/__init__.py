"""Signed HTTP requests with alarms and events, from the same outbox as MQTT: at least once and in order.

The format is that of Standard Webhooks (docs/adr/webhook-by-the-standard-library.md).
"""

from gateway.uplink.webhook.receiver import PostResult, PostVerdict, WebhookReceiver
from gateway.uplink.webhook.settings import WebhookSettings, webhook_settings
from gateway.uplink.webhook.signature import SecretError, secrets_of, signed
from gateway.uplink.webhook.webhook import Webhook

__all__ = [
    "PostResult",
    "PostVerdict",
    "SecretError",
    "Webhook",
    "WebhookReceiver",
    "WebhookSettings",
    "secrets_of",
    "signed",
    "webhook_settings",
]
