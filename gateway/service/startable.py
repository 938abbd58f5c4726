"""Whether a service of these settings could start and do its work, as far as that can be told without the bus."""

from collections.abc import Iterator

from gateway.bus.live import what_lacks
from gateway.config import Settings
from gateway.errors import ConfigurationError
from gateway.web import TokenFile, refuse_open_address


def startable_faults(settings: Settings) -> Iterator[str]:
    """Everything that would keep it from starting or from showing a fresh estimate, each with how to mend it."""
    lacking = what_lacks(settings.bus.interface)
    if lacking is not None:
        yield lacking
    if settings.broadcast.interface is not None and (lacking := what_lacks(settings.broadcast.interface)) is not None:
        yield lacking.replace("[bus]", "[broadcast]")
    try:
        refuse_open_address(settings.web.host, has_tokens=_has_tokens(settings))
    except ConfigurationError as fault:
        yield str(fault)
    if settings.web.stale_after_s < settings.batch.window_s:
        yield (
            f"[web] stale_after_s = {settings.web.stale_after_s:g} is below [batch] window_s = "
            f"{settings.batch.window_s:g}: every estimate would be stale before the next; set it to three windows"
        )


def _has_tokens(settings: Settings) -> bool:
    """Whether the service has tokens; true too where others may not look: it is the service's own folder."""
    try:
        return bool(TokenFile(settings.store.directory / "tokens.json").tokens())
    except ConfigurationError:
        return True
