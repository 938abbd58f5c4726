"""A line file for people to read."""

from collections.abc import Iterator

from gateway.calibration.file import LineFile
from gateway.calibration.line.scatter import SCATTER_STD
from gateway.core.cross_spectrum.model.parameters import is_positive


def line_text(held: LineFile) -> str:
    """The whole file but its arrays, in lines."""
    n = held.line.n_siblings
    scatter = f"estimated from {n} of them (default in brackets)" if n else "the defaults"
    sections = {
        "vehicles": _vehicles(held),
        "intervals": _limits(held),
        f"differences between two vehicles, standard deviations: {scatter}": _scatter(held),
        "warnings": iter(held.warnings or ("none",)),
    }
    lines = [f"id {held.id}"]
    for title, rows in sections.items():
        lines += ["", title, *(f"  {row}" for row in rows)]
    return "\n".join(lines)


def _vehicles(held: LineFile) -> Iterator[str]:
    for one in held.siblings:
        yield f"{one.name:28}{one.empty_mass_kg:7.0f} kg {one.n_runs:4} runs  {one.id}"


def _limits(held: LineFile) -> Iterator[str]:
    errors = held.expected_errors
    if errors is None or errors.payload_rms_kg is None or errors.front_share_rms_pct is None:
        yield "no sibling was left out: as wide as those of the widest member"
    else:
        share = f"{errors.front_share_rms_pct:.2f} percentage points rms"
        yield f"siblings left out: payload {errors.payload_rms_kg:.1f} kg rms, front share {share}"
    limits = held.line.limits
    payload_kg, share_pct, _ = limits.model_std
    yield f"{'error of the model':28}{payload_kg:.1f} kg, {share_pct:.2f} percentage points (standard deviations)"
    yield f"{'misfit believed up to':28}{limits.misfit_limit:.2f}"


def _scatter(held: LineFile) -> Iterator[str]:
    for name, std in held.line.scatter_std.items():
        default = f" ({_std(name, SCATTER_STD[name])})" if held.line.n_siblings and name in SCATTER_STD else ""
        yield f"{name:28}{_std(name, std):>8}{default}"


def _std(name: str, std: float) -> str:
    return f"{100.0 * std:.1f} %" if is_positive(name) else f"{std:.2g}"
