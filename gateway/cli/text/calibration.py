"""A calibration file for people to read."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict

from gateway.calibration.file import CalibrationFile, ExpectedErrorsPart, Figure, LinePart, figures_of


def calibration_text(held: CalibrationFile) -> str:
    """The whole file but its arrays, in lines."""
    sections = {
        "vehicle (as the campaign stated it)": _vehicle(held),
        "calibrated for": _ranges(held),
        "expected errors (runs left out of the fit)": _expected(held),
        **({"inherited from its line": _line(held.line)} if held.line else {}),
        **{_title(part, figures): _figures(figures, held.line) for part, figures in figures_of(held).items()},
        "warnings": iter(held.warnings or ("none",)),
        "made by": _provenance(held),
    }
    lines = [held.id, f"version {held.version}"]
    lines.append(f"estimators: {', '.join(held.estimators) or 'none'}")
    for title, rows in sections.items():
        lines += ["", title, *(f"  {row}" for row in rows)]
    return "\n".join(lines)


def _vehicle(held: CalibrationFile) -> Iterator[str]:
    for name, stated in asdict(held.vehicle).items():
        if stated is not None:
            yield f"{name:28}{_plain(stated)}"


def _plain(stated: object) -> str:
    if isinstance(stated, tuple):
        return " to ".join(map(_plain, stated))
    return f"{stated:g}" if isinstance(stated, float) else str(stated)


def _ranges(held: CalibrationFile) -> Iterator[str]:
    for name, span in held.seen.model_dump().items():
        yield f"{name:28}{'unknown' if span is None else f'{span[0]:.4g} to {span[1]:.4g}'}"


def _expected(held: CalibrationFile) -> Iterator[str]:
    for estimator in held.estimators:
        errors = held.expected_errors.get(estimator)
        running = "; the service runs this one by default" if estimator == held.estimators[0] else ""
        yield f"{estimator:28}{'unknown' if errors is None else _errors(errors)}{running}"


def _errors(errors: ExpectedErrorsPart) -> str:
    payload, share = errors.payload_rms_kg, errors.front_share_rms_pct
    parts = ["payload unknown" if payload is None else f"payload {payload:.1f} kg rms"]
    parts.append("front share unknown" if share is None else f"front share {share:.2f} percentage points rms")
    return ", ".join(parts)


def _title(part: str, figures: Sequence[Figure]) -> str:
    return f"{part}: {len(figures)} parameters ± their standard deviations"


def _figures(figures: Sequence[Figure], line: LinePart | None) -> Iterator[str]:
    """With a line, inherited parameters are distinguished from the vehicle's own."""
    for figure in figures:
        row = f"{figure.name:28}{figure.centre:>12.5g} ± {figure.std:.2g}"
        yield row if line is None else f"{row:52}{'inherited' if figure.name in line.scatter_std else 'its own'}"


def _line(line: LinePart) -> Iterator[str]:
    scatter = f"estimated from {line.n_siblings} of them" if line.n_siblings else "the defaults"
    yield f"{'scatter between vehicles':28}{scatter}"
    yield from (f"{'ancestor':28}{member}" for member in line.members)


def _provenance(held: CalibrationFile) -> Iterator[str]:
    made = held.provenance
    yield made.software
    yield made.command
    yield f"campaign sha256 {made.campaign_sha256}"
    for run in made.runs:
        yield (
            f"run {run.number:<3} {run.payload_kg:7.1f} kg {run.front_share_pct:6.2f} %  {run.n_batches:3} batches  "
            f"{run.log}  sha256 {run.sha256[:12]}..."
        )
