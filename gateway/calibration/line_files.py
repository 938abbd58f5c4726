"""Lines and their files: from calibration files to a line, and to and from its file."""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.line_file import LikeFile, LineFile, SiblingPart
from gateway.calibration.file.parts import NAMES, EvidencePart, ExpectedErrorsPart, LinePart
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.left_out import Sibling, with_siblings_left_out
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS
from gateway.errors import LineError

NOT_LEFT_OUT = "siblings_not_left_out"
"""The line's intervals are as wide as its widest member's: they were not tested on a vehicle left out."""


def sister_of(file: CalibrationFile) -> Sister:
    """A calibration as a member of its line. Raises LineError if it has no half-car."""
    if file.cross_spectrum is None:
        raise LineError(
            f"{file.vehicle.name} ({file.id}): has no cross_spectrum calibration, which a line needs: "
            "calibrate it again without --estimator ratio_index"
        )
    return Sister(file.id, file.vehicle, file.cross_spectrum, line_in(file.line) if file.line else None)


def line_of_files(files: Sequence[LikeFile]) -> Line:
    """The line of calibrations of sister vehicles and at most one line file.

    Raises LineError if they make none.
    """
    lines = [line_in(one.line) for one in files if isinstance(one, LineFile)]
    if len(lines) > 1:
        raise LineError(
            "two line files: if their vehicles are of one line, build one line of all their calibrations with "
            "`springscale line build`"
        )
    return line_of([sister_of(one) for one in files if isinstance(one, CalibrationFile)], *lines)


def line_part(line: Line) -> LinePart:
    """The line in the form of its file."""
    stds = zip(NAMES, line.scatter_std.tolist(), strict=True)
    half_car = EvidencePart.of(line.half_car.information, line.half_car.pull, PARAMETERS)
    return LinePart(
        members=line.members,
        wheelbase_m=line.wheelbase_m,
        empty_mass_kg=line.empty_mass_kg,
        usual=line.usual,
        half_car=half_car,
        roll=EvidencePart.of(line.roll.information, line.roll.pull, ROLL_PARAMETERS) if line.roll else None,
        scatter_std={name: std for name, std in stds if std > 0.0},
        n_siblings=line.n_siblings,
        seen=line.seen,
        limits=line.limits,
    )


def line_in(part: LinePart) -> Line:
    """The line in a file. Raises CalibrationFileError if the model now has other parameters."""
    part.require_known()
    return Line(
        members=part.members,
        wheelbase_m=part.wheelbase_m,
        empty_mass_kg=part.empty_mass_kg,
        usual=part.usual,
        half_car=Evidence(*part.half_car.spread(PARAMETERS)),
        roll=Evidence(*part.roll.spread(ROLL_PARAMETERS)) if part.roll else None,
        scatter_std=part.scatter,
        n_siblings=part.n_siblings,
        seen=part.seen,
        limits=part.limits,
    )


def build_line(
    files: Sequence[CalibrationFile],
    runs: Mapping[str, Sequence[KnownRun]],
    on_sibling: Callable[[], None] = lambda: None,
) -> LineFile:
    """The line of ``files``, each once however often it is named.

    With the ``runs`` of two or more of them, by id, each is left out in turn. ``on_sibling`` is called after each.
    Raises LineError if the files make no line, or the runs do not suffice to leave one out.
    """
    files = list({one.id: one for one in files}.values())
    line = line_of_files(files)
    warnings: tuple[str, ...] = (NOT_LEFT_OUT,)
    expected = None
    if runs:
        siblings = [Sibling(sister_of(one), tuple(runs.get(one.id, ()))) for one in files]
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
        line=line_part(line),
        expected_errors=expected,
        warnings=warnings,
    )
