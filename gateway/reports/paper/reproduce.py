"""`springscale reproduce`: the paper's section 4 with our simulator, as one page with figures and tables."""

import json
import math
from pathlib import Path
from typing import Any

from gateway.errors import ConfigurationError
from gateway.reports.charts.figures import save
from gateway.reports.paper import figures as draw
from gateway.reports.paper.experiments import N_STEPS, Experiments, Extent, Method, OnStep, gather
from gateway.reports.paper.page import PLATES, page
from gateway.reports.paper.table import accuracy_page, rows_of, tables_of


def reproduce(output: Path, extent: Extent, on_step: OnStep = lambda what, done, of: None) -> Path:
    """Write report.html, figures/, accuracy.md, results.json, calibrations and campaigns; return the report's path.

    Raises ConfigurationError if the directory already contains a reproduction.
    """
    report = output / "report.html"
    if report.exists() or (output / "campaigns").exists():
        raise ConfigurationError(f"{output}: there is a reproduction already; name another directory or remove it")
    output.mkdir(parents=True, exist_ok=True)
    experiments = gather(output, extent, on_step)
    on_step("judging and drawing", N_STEPS - 1, N_STEPS)
    results = results_of(experiments)
    drawings = [(plate, save(plate.drawn(experiments), output / "figures", plate.name)) for plate in PLATES]
    save(draw.figure_drive(experiments, "test3", best_method(experiments)), output / "figures", "drive")
    text = json.dumps(results, indent=1, allow_nan=False)
    (output / "results.json").write_text(text + "\n", encoding="utf-8")
    (output / "accuracy.md").write_text(accuracy_page(results), encoding="utf-8")
    report.write_text(page(experiments, rows_of(results["tables"]), drawings), encoding="utf-8")
    return report


def best_method(experiments: Experiments) -> Method:
    """The method with the smallest payload error over test 3, missing estimates included."""

    def error(method: Method) -> float:
        error_pct = experiments.errors("test3", "validation", method).payload.mean_abs_pct_with_misses
        return math.inf if error_pct is None else error_pct

    return min(experiments.simulated, key=error)


def results_of(experiments: Experiments) -> dict[str, Any]:
    """All results as numbers: the contents of results.json."""
    return {
        "seed": experiments.extent.seed,
        "window_s": experiments.extent.window_s,
        "is_whole": experiments.extent.is_whole,
        "tables": tables_of(experiments),
        "sensitivity": [
            {
                "condition": draw.condition_of(run),
                "method": method.label,
                "payload_error_kg": _known(payload_kg),
                "share_error_pp": _known(share_pp),
            }
            for run in experiments.driven["sensitivity"].runs
            for method in experiments.simulated
            for payload_kg, share_pp in [draw.mean_errors(run, method)]
        ],
    }


def _known(x: float) -> float | None:
    return x if math.isfinite(x) else None
