"""A campaign's drives read and inspected, before anything is fitted to them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gateway.calibration.inspection.finding import Finding, RunVerdict, Severity
from gateway.calibration.inspection.kinds import Kind
from gateway.calibration.inspection.split_run import SplitRun


@dataclass(frozen=True, slots=True)
class Inspection:
    """Every run with its verdict, in the order of the campaign; ``findings`` are of the campaign as a whole."""

    split: tuple[SplitRun, ...]
    verdicts: tuple[RunVerdict, ...]
    findings: tuple[Finding, ...]

    @property
    def usable(self) -> tuple[SplitRun, ...]:
        """The runs without a fault."""
        return tuple(one for one, verdict in zip(self.split, self.verdicts, strict=True) if verdict.is_usable)

    def excusing(self, kind: Kind) -> "Inspection":
        """Without what it says of the campaign as a whole of this ``kind``."""
        return replace(self, findings=tuple(one for one in self.findings if one.kind is not kind))

    @property
    def refusal(self) -> str | None:
        """Why no calibration is worth its name; None where the usable runs carry one."""
        stated = [one for one in self.split if one.has_identification]
        left = [one for one in self.usable if one.has_identification]
        if not stated:
            return (
                "no run is meant for identification: identification_fraction or the runs' split leave nothing "
                "to calibrate from"
            )
        if not left:
            return "no run can be used"
        if len(_payloads_kg(left)) == 1 < len(_payloads_kg(stated)):
            return f"faults leave runs with {left[0].identification.payload_kg:g} kg alone, which is no scale"
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a calibration file has to remember of all this."""
        return tuple(self._warnings())

    def _warnings(self) -> Iterator[str]:
        yield from (f"{one.kind}: {one.text}" for one in self.findings if one.severity is not Severity.NOTE)
        for verdict in self.verdicts:
            kept = Severity.WARNING if verdict.is_usable else Severity.FAULT
            what = f"run {verdict.number}" if verdict.is_usable else f"run {verdict.number} left out"
            yield from (f"{what}: {one.kind}: {one.text}" for one in verdict.findings if one.severity is kept)


def _payloads_kg(runs: Sequence[SplitRun]) -> set[float]:
    return {one.identification.payload_kg for one in runs}
