"""springscale check-config: everything that can be checked without the bus."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from gateway.bus.signals.signal_map import unsound_messages
from gateway.calibration.fitter_answers import doubts_of_vehicle
from gateway.cli.options import FILE, Told, prints
from gateway.config import Settings, load_settings
from gateway.core.weights.limits import Limits
from gateway.errors import ConfigurationError
from gateway.service.calibration_in_use import learnt
from gateway.service.lifecycle import startable_faults
from gateway.setup import Setup, setup_of
from gateway.stated.doubt import DoubtKind
from gateway.uplink.settings import uplink_settings, webhook_settings
from gateway.words import some


@click.command("check-config")
@click.argument("config", type=FILE)
@prints
def check_config(config: Path) -> Told:
    """Check CONFIG, its signal map, its DBC files and its calibration; name every fault."""
    settings = load_settings(config)
    setup = setup_of(settings)
    faults = tuple(startable_faults(settings, setup.signal_map))
    if faults:
        raise ConfigurationError("\n".join(f"{config}: {fault}" for fault in faults))
    forwarding = uplink_settings(settings.uplink, settings.vehicle)
    pushing = webhook_settings(settings.webhook, settings.vehicle)
    summary: dict[str, Any] = {
        "config": str(config),
        "signals": [str(signal) for signal in setup.signal_map.signals],
        "calibration_id": setup.calibration.id if setup.calibration else None,
        "estimator": setup.estimator,
        "interface": settings.bus.interface,
        "channel": settings.bus.channel,
        "limits": limits_in_force(setup),
        "uplink": forwarding.broker if forwarding else None,
        "webhook": pushing.receiver if pushing else None,
        "unsound_messages": list(unsound_messages(setup.signal_map.name)),
    }
    left_out = [f"Left out, as the signal map does not use it: {fault}" for fault in summary["unsound_messages"]]
    return summary, "\n".join([*_sentences(config, settings, setup), *some(left_out, "")])


def _sentences(config: Path, settings: Settings, setup: Setup) -> Iterator[str]:
    yield f"{config}: good. Reads {', '.join(setup.signal_map.signals)} from {settings.bus.channel}."
    chosen, in_use, _ = learnt(settings)
    if chosen.calibration != settings.calibration:
        yield f"The service weighs with the calibration that it has learnt: {chosen.calibration}."
    elif setup.calibration is None:
        yield (
            "No calibration is configured: batches will carry spectra and rejected = no_calibration, until one is "
            "learnt from drives (page /teach)."
        )
    elif limits := limits_in_force(setup):
        yield f"It may weigh: {', '.join(f'{name} {kg:g} kg' for name, kg in limits.items())}."
    else:
        yield "No limit is known, so no overload can be reported. See [vehicle] gross_limit_kg."
    for doubt in doubts_of_vehicle(in_use.calibrated.vehicle) if in_use.calibrated else ():
        if doubt.kind in (DoubtKind.GROSS_LIMIT, DoubtKind.AXLE_LIMIT):
            yield f"Unlikely, and overloads are reported by it: {doubt.sentence}."


def limits_in_force(setup: Setup) -> dict[str, float]:
    """The limits in force by name: those of the settings, and those that the calibration was made with."""
    of_calibration = Limits.of(setup.calibrated.vehicle) if setup.calibrated else Limits()
    return of_calibration.overridden_by(setup.limits).stated()
