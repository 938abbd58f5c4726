"""The signal maps that come with the package, held against what was heard."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.heard import Heard
from gateway.bus.signals import Decoder, SignalMap, load_signal_map, shipped_map, shipped_maps
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2
from gateway.records import ASIDE, Signal
from gateway.units import STANDARD_GRAVITY_MPS2

NEEDED: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)


@dataclass(frozen=True, slots=True)
class Fit:
    """A shipped map on one channel: which signals come, which that weigh do not, what its vertical axis reads."""

    name: str
    device: str
    channel: str | None
    found: tuple[Signal, ...]
    missing: tuple[Signal, ...]
    gravity_mps2: float

    @property
    def is_whole(self) -> bool:
        """Whether both inertial signals come, and gravity is where the map says."""
        has_gravity = abs(self.gravity_mps2 - STANDARD_GRAVITY_MPS2) < GRAVITY_TOLERANCE_MPS2
        return has_gravity and all(signal in self.found for signal in NEEDED)


def fits_of(heard: Sequence[Heard]) -> tuple[Fit, ...]:
    """The maps of which at least one signal comes, the best first."""
    fits = [fit for name in shipped_maps() for fit in _fits(name, heard)]
    return tuple(sorted(fits, key=lambda fit: (not fit.is_whole, len(fit.missing), fit.name)))


def _fits(name: str, heard: Sequence[Heard]) -> Iterator[Fit]:
    signal_map = load_signal_map(f"springscale:{name}")
    device = shipped_map(name).read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").rstrip(".")
    for channel in sorted({one.channel for one in heard}, key=str):
        ours = [one for one in heard if one.channel == channel and _is_mapped(one, signal_map)]
        if not ours:
            continue
        motion = Decoder(signal_map).decode(merge_frames([one.frames for one in ours]))
        found = tuple(signal for signal in motion.signals if len(motion.of(signal)[1]))
        missing = tuple(signal for signal in motion.signals if signal not in found and signal not in ASIDE)
        vertical = motion.of(Signal.VERTICAL_ACCELERATION)[1]
        if found:
            yield Fit(name, device, channel, found, missing, float(np.median(vertical)) if len(vertical) else np.nan)


def _is_mapped(one: Heard, signal_map: SignalMap) -> bool:
    ids = np.array([one.can_id], np.uint32)
    return any(message.id_filter.matches(ids)[0] and message.length in one.lengths for message in signal_map.messages)
