"""Whatever the legs, a drive is smooth, ends as asked and covers the way its speed says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.sim.drive import JERK_MPS3, STEP_S, Leg, drive_of

speeds = st.one_of(st.just(0.0), st.floats(3.0, 36.0))
legs = st.lists(st.builds(Leg, speeds, st.floats(0.0, 60.0), st.floats(0.4, 3.0)), min_size=1, max_size=6)


@given(legs=legs, start_mps=speeds)
def test_acceleration_and_jerk_stay_bounded(legs, start_mps):
    drive = drive_of(legs, start_mps)
    acceleration = np.diff(drive.speed_mps) / STEP_S
    sharpest = max(leg.acceleration_mps2 for leg in legs)
    assert np.max(np.abs(acceleration), initial=0.0) <= sharpest + 1e-6
    assert np.max(np.abs(np.diff(acceleration)), initial=0.0) / STEP_S <= 1.001 * JERK_MPS3 + 1e-6


@given(legs=legs, start_mps=speeds)
def test_it_begins_and_ends_at_the_speeds_asked(legs, start_mps):
    drive = drive_of(legs, start_mps)
    assert drive.speed_mps[0] == pytest.approx(start_mps, abs=1e-9)
    assert drive.speed_mps[-1] == pytest.approx(legs[-1].speed_mps, abs=1e-6)
    low, high = (bound([start_mps, *(leg.speed_mps for leg in legs)]) for bound in (min, max))
    assert low - 1e-9 <= np.min(drive.speed_mps)
    assert np.max(drive.speed_mps) <= high + 1e-9


@given(legs=legs, start_mps=speeds, cut=st.floats(0.0, 1.0))
def test_the_way_adds_up_over_any_cut(legs, start_mps, cut):
    drive = drive_of(legs, start_mps)
    middle_s = round(cut * drive.duration_s / STEP_S) * STEP_S
    first, second = drive.part(0.0, middle_s), drive.part(middle_s, drive.duration_s)
    assert first.travelled_m[-1] + second.travelled_m[-1] == pytest.approx(drive.travelled_m[-1], abs=1e-6)
    assert np.all(np.diff(drive.travelled_m) >= 0.0)
