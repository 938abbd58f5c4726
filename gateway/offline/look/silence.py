"""Why a mapped signal has no valid sample in a log: no frames, and what there is instead, or frames refused."""

from pathlib import Path

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import MappedMessage, SignalMap, id_name
from gateway.bus.similar import similar_to
from gateway.offline.look.heard import heard_in
from gateway.records import Signal


def why_silent(log: Path, signal_map: SignalMap, signal: Signal) -> str:
    """In words. Reads the log once or twice more; raises LogUnreadableError as every reader does."""
    message = next(m for m in signal_map.messages if any(mapped.signal is signal for mapped in m.signals))
    motions, _, decoder = motion_of_log(log, signal_map)
    for _ in motions:
        pass
    refused = decoder.counts[signal].rejected
    if n := sum(refused.values()):
        reasons = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in sorted(refused.items()))
        return f"{n} frames of {_named(message)} came, none valid: {reasons}"
    if decoder.counts[signal].samples:
        return f"{decoder.counts[signal].samples} frames of {_named(message)} came, none of them within the run"
    similar = similar_to(message, signal_map, heard_in(log)[0])
    instead = f"similar: {'; '.join(similar)}" if similar else "and no identifier like it"
    on = f" on {signal_map.channel}" if signal_map.channel else ""
    return f"nothing of {_named(message)} came{on}; {instead}"


def _named(message: MappedMessage) -> str:
    return f"{message.name} ({id_name(message.frame_id)})"
