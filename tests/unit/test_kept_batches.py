"""Batches kept for calibrations to come: bit for bit what they were, and damage is told."""

from dataclasses import replace

import numpy as np
import pytest
from support.bus_drive import bus_drive
from support.drives import assert_same_batch

from gateway.bus.signals import Decoder, load_signal_map
from gateway.calibration.inspection.facts import row_facts
from gateway.calibration.kept import KeptBatch, kept_batch_of, packed, unpacked
from gateway.core.batch_settings import BatchSettings
from gateway.errors import KeptBatchError
from gateway.records import Batch, Motion, Why
from gateway.weighing.flow import Flow, Identity

MAP = load_signal_map("springscale:reference")
SETTINGS = BatchSettings(window_s=20.0)


def driven(duration_s: float) -> Motion:
    return Decoder(MAP).decode(bus_drive(duration_s, seed=1))


def kept_of(motion: Motion, settings: BatchSettings = SETTINGS) -> list[KeptBatch]:
    """The batches that a service with these settings would keep of the rows."""
    found: list[KeptBatch] = []
    flow = Flow(settings, MAP.traits, None, "cross_spectrum", Identity("van-17"))

    def keep(batch: Batch, rows: Motion) -> None:
        if not batch.rejected:
            found.append(kept_batch_of(batch, rows, MAP.traits))

    flow.on_window = keep
    list(flow.feed(motion))
    list(flow.flush())
    return found


@pytest.fixture(scope="module")
def three() -> list[KeptBatch]:
    return kept_of(driven(65.0))[:3]


def test_a_batch_comes_back_bit_for_bit(three: list[KeptBatch]) -> None:
    for kept in three:
        same = unpacked(packed(kept))
        assert same.facts == kept.facts
        assert_same_batch(same.batch, kept.batch)


def test_a_batch_with_a_roll_rate_and_unknown_numbers_comes_back_too(three: list[KeptBatch]) -> None:
    n = len(three[0].batch.usable)
    roll = np.where(np.arange(n) % 7 == 0, np.nan, np.sin(np.arange(n)))
    odd = replace(three[0].batch, roll_rate_radps=roll, gravity_mps2=np.nan, rejected=(Why.GAP,), shares={Why.GAP: 0.5})
    same = unpacked(packed(replace(three[0], batch=odd))).batch
    assert np.isnan(same.gravity_mps2)
    assert_same_batch(replace(same, gravity_mps2=0.0), replace(odd, gravity_mps2=0.0))


def test_facts_are_of_the_window_alone(three: list[KeptBatch]) -> None:
    motion = driven(65.0)
    begin = int(motion.t_ns[0])
    window = motion.rows((motion.t_ns >= begin) & (motion.t_ns < begin + 20 * 10**9))
    assert three[0].facts == row_facts(window, MAP.traits)


def test_one_flipped_bit_is_reported(three: list[KeptBatch]) -> None:
    content = bytearray(packed(three[0]))
    for at in (3, 400, len(content) // 2, len(content) - 1):
        damaged = content.copy()
        damaged[at] ^= 4
        with pytest.raises(KeptBatchError, match="damaged"):
            unpacked(bytes(damaged))
    with pytest.raises(KeptBatchError):
        unpacked(b"")
