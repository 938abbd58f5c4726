"""From calibrations of several vehicles to the file of their line."""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

from gateway.calibration.file import CalibrationFile, ExpectedErrorsPart, LineFile, LinePart, SiblingPart, line_of_files
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line import Sibling, with_siblings_left_out

NOT_LEFT_OUT = "siblings_not_left_out"
"""The line's intervals are as wide as its widest member's: no vehicle was calibrated as the next one will be."""


def build_line(
    files: Sequence[CalibrationFile],
    runs: Mapping[str, Sequence[KnownRun]],
    on_sibling: Callable[[], None] = lambda: None,
) -> LineFile:
    """The line of ``files``, each once however often it is named.

    With the ``runs`` of two or more of them, by id, each is left out in turn: no twin must tell what it is asked.
    ``on_sibling`` is called after each that was. Raises LineError where the files make no line, or what is given of
    runs is too little to leave one out.
    """
    files = list({one.id: one for one in files}.values())
    line = line_of_files(files)
    warnings: tuple[str, ...] = (NOT_LEFT_OUT,)
    expected = None
    if runs:
        siblings = [Sibling(one.sister(), tuple(runs.get(one.id, ()))) for one in files]
        tested = with_siblings_left_out(siblings, line, on_sibling)
        line, warnings = tested.line, ()
        expected = ExpectedErrorsPart(
            payload_rms_kg=tested.payload_rms_kg, front_share_rms_pct=tested.front_share_rms_pct
        )
    return LineFile(
        software=f"springscale {version('springscale')}",
        siblings=tuple(
            SiblingPart(
                id=one.id,
                name=one.vehicle.name,
                empty_mass_kg=one.vehicle.empty_mass_kg,
                n_runs=len(one.provenance.runs),
            )
            for one in sorted(files, key=lambda one: one.id)
        ),
        line=LinePart.of(line),
        expected_errors=expected,
        warnings=warnings,
    )
