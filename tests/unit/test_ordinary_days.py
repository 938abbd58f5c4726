"""The study of ordinary days: what is told of each tour, and the figures of what was learnt."""

import numpy as np

from benchmarks.accuracy import ordinary_days as study
from gateway.calibration.known_run import KnownRun

DAYS = [KnownRun(day, "tour", 0.0 if day % 5 == 0 else 100.0 + day, 55.0, (), 0.0) for day in range(1, 401)]


def test_simulated_notes_are_low_and_sometimes_swapped() -> None:
    told = study._notes(DAYS, np.random.SeedSequence(1))
    right = {
        day: study.EMPTY if not run.payload_kg else study.note(study.LOW * run.payload_kg)
        for day, run in enumerate(DAYS, 1)
    }
    assert len(told) == len(DAYS)
    wrong = sum(told[day] != right[day] for day in told)
    assert 0.02 < wrong / len(DAYS) < 0.08


def test_the_figures_count_errors_misses_and_refusals() -> None:
    """One batch is held, one misses by 3 beyond a half-width of 1, one is refused."""
    held, missed = [2.0, 5.0, 0.0, 1.0, 2.0, 0.0], [4.0, 1.0, 3.0, 3.0, 2.0, 1.0]
    cases = [{f"{study.NOTHING}|1": [held, []]}, {f"{study.NOTHING}|1": [missed]}]
    (line,) = study.numbers(7, 2, cases)["lines"]
    assert (line["n"], line["refused"], line["beyond_twice_pct"], line["least_held_of_a_van_pct"]) == (2, 1, 50.0, 0.0)
    assert line["payload"] == {"error": 3.0, "half": 3.0, "held": 50.0, "score": (10.0 + 2.0 + 40.0 * 3.0) / 2.0}
    assert "| nothing stated | 3.0 ±3 (50) | – | – | – | 0 |" in study.section({"n_vans": 2, "lines": [line]})
