"""The study of ordinary days: its table counts errors, misses and refusals."""

from benchmarks.accuracy import ordinary_days as study


def test_the_figures_count_errors_misses_and_refusals() -> None:
    """One batch is held, one misses by 3 beyond a half-width of 1, one is refused."""
    held, missed = [2.0, 5.0, 0.0, 1.0, 2.0, 0.0], [4.0, 1.0, 3.0, 3.0, 2.0, 1.0]
    cases = [{f"{study.NOTHING}|1": [held, []]}, {f"{study.NOTHING}|1": [missed]}]
    (line,) = study.numbers(7, 2, cases)["lines"]
    assert (line["n"], line["refused"], line["beyond_twice_pct"], line["least_held_of_a_van_pct"]) == (2, 1, 50.0, 0.0)
    assert line["payload"] == {"error": 3.0, "half": 3.0, "held": 50.0, "score": (10.0 + 2.0 + 40.0 * 3.0) / 2.0}
    assert "| nothing stated | 3.0 ±3 (50) | – | – | – | 0 |" in study.section({"n_vans": 2, "lines": [line]})
