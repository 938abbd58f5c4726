"""The facts of a drive that is stored as several batches."""

from collections.abc import Sequence

import numpy as np

from gateway.calibration.inspection.rows import RowFacts, Stream


def joined_facts(parts: Sequence[RowFacts]) -> RowFacts:
    """Facts of several stretches (at least one) as of one drive; quantiles of the whole are taken from those of the
    parts.
    """
    signals = dict.fromkeys(signal for part in parts for signal in part.streams)
    streams = {
        signal: _joined_stream([part.streams[signal] for part in parts if signal in part.streams]) for signal in signals
    }
    return RowFacts(sum(part.duration_s for part in parts), streams)


def _joined_stream(streams: Sequence[Stream]) -> Stream:
    """Scatter by the law of total variance; the widest range of all parts."""
    spoke = [stream for stream in streams if stream.n >= 2]
    if len(spoke) < 2:
        return spoke[0] if spoke else streams[0]
    n = np.array([stream.n for stream in spoke], float)
    means = np.array([stream.mean for stream in spoke])
    mean = float(np.average(means, weights=n))
    variances = np.array([stream.std for stream in spoke]) ** 2 + (means - mean) ** 2
    return Stream(
        n=int(n.sum()),
        rate_hz=float(np.average([stream.rate_hz for stream in spoke], weights=n)),
        jitter_share=float(np.average([stream.jitter_share for stream in spoke], weights=n)),
        mean=mean,
        std=float(np.sqrt(np.average(variances, weights=n))),
        low=min(stream.low for stream in spoke),
        middle=float(np.average([stream.middle for stream in spoke], weights=n)),
        high=max(stream.high for stream in spoke),
        resolution=spoke[0].resolution,
    )
