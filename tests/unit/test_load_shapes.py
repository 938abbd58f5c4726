"""Loads of the studies: every kind has its length, height and place, and the mass that was asked for."""

import numpy as np
import pytest

from benchmarks.accuracy.loads import FLOOR_PART, SAYS, Shape, drawn_load, shaped_load
from gateway.sim.vans import VANS
from gateway.sim.vehicle import Vehicle, payload_kg


@pytest.mark.parametrize("van", VANS.values(), ids=list(VANS))
@pytest.mark.parametrize("shape", Shape)
def test_a_load_is_as_heavy_as_asked_and_within_the_vehicle(shape: Shape, van: Vehicle) -> None:
    for seed in range(30):
        place_m = float(np.random.default_rng(seed).uniform(0.1, 1.1)) * van.wheelbase_m
        loads = shaped_load(shape, van, 250.0, place_m, np.random.default_rng(seed))
        assert payload_kg(loads) == pytest.approx(250.0)
        for load in loads:
            assert load.position_m - 0.5 * load.length_m >= 0.0
            assert load.position_m + 0.5 * load.length_m <= van.wheelbase_m + 2.6
            assert load.height_m >= 0.6


def test_kinds_differ_as_their_names_say() -> None:
    van = VANS["paper_van"]

    def extent(shape: Shape) -> tuple[float, float]:
        loads = [shaped_load(shape, van, 250.0, 1.4, np.random.default_rng(seed))[0] for seed in range(50)]
        return float(np.mean([one.length_m for one in loads])), float(np.mean([one.tall_m for one in loads]))

    extents = {shape: extent(shape) for shape in Shape}
    assert extents[Shape.PARCELS][0] > 1.5 * extents[Shape.BOX][0]
    assert extents[Shape.BAY][0] == pytest.approx(FLOOR_PART * van.wheelbase_m)
    assert extents[Shape.PIPES][0] > extents[Shape.LONG][0]
    assert extents[Shape.PIPES][1] < 0.5
    assert extents[Shape.TALL][1] > 1.2
    assert len(shaped_load(Shape.ROOF, van, 250.0, 1.4, np.random.default_rng(1))) == 2
    assert set(SAYS) == set(Shape)


def test_what_is_drawn_is_of_every_kind() -> None:
    van = VANS["paper_van"]
    lengths = {round(drawn_load(van, 250.0, 1.4, np.random.default_rng(seed))[0].length_m, 3) for seed in range(60)}
    assert len(lengths) > 30
    assert min(lengths) < 1.2
    assert max(lengths) > 2.5
