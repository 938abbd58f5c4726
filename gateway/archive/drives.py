"""Runs a job's logs through the pipeline; a drive continues from one log to the next where the recording does.

Otherwise a log begins a new drive, as a gateway that starts with the ignition does, and as `springscale estimate` does
for that log.
"""

from collections.abc import Iterable, Iterator, Sequence

from gateway.archive.jobs import ArchiveJob, JobLog
from gateway.archive.places import PlaceError
from gateway.bus.logs import LogReport, motion_of_log
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ConfigurationError, LogUnreadableError, ReaderMissingError
from gateway.estimates.batch_estimate import Estimate
from gateway.records import Batch
from gateway.units import NS_PER_S
from gateway.weighing.flow import Flow


class JobDrives:
    """Processes a job's logs in order."""

    def __init__(self, job: ArchiveJob) -> None:
        """Continues from the end of the lead-in logs."""
        self._job = job
        self._open: tuple[JobLog, Flow] | None = None  # the log before, if it may continue, and the pipeline at its end
        self._lead_in()

    def take(self, one: JobLog, next_ns: int | None) -> tuple[list[Estimate], LogReport]:
        """The estimates of the batches that end in the next log, and its reader's report; ``next_ns`` is the first
        frame of the log after it.

        Raises PlaceError if it cannot be read now, LogUnreadableError if it is invalid; then call :meth:`break_off`
        before the one after it.
        """
        flow = self._open[1].branch() if self._open else self._flow()
        with one.log.place.fetched(one.log.path) as fetched:
            if fetched.sha256 != one.facts.sha256:
                raise PlaceError(f"{one.log.name}: was changed while the archive was read; run again")
            try:
                motions, report = motion_of_log(fetched.path, self._job.setup.signal_map)
                estimates, newest_ns = [], None
                for motion in motions:
                    if len(motion):
                        newest_ns = max(int(motion.t_ns.max()), newest_ns or 0)
                        estimates += self._weighed(flow, flow.scheduler.feed(motion))
                report.require_dates()
            except Exception as fault:
                raise _of_the_log(fault, one, str(fetched.path)) from fault
        self._open = (one, flow) if goes_on(newest_ns, next_ns, self._job.settings) else None
        if self._open is None:
            estimates += self._weighed(flow, flow.scheduler.flush())
        return estimates, report

    def break_off(self) -> list[tuple[JobLog, Estimate]]:
        """Close the log under way as if none had followed, and return its remaining estimates."""
        before, self._open = self._open, None
        if before is None:
            return []
        one, flow = before
        return [(one, found) for found in self._weighed(flow, flow.scheduler.flush())]

    def _flow(self) -> Flow:
        setup, job = self._job.setup, self._job
        return Flow(job.settings, setup.signal_map.traits, setup.calibrated, setup.estimator, job.identity)

    def _weighed(self, flow: Flow, batches: Iterable[Batch]) -> list[Estimate]:
        found: list[Estimate] = []
        for batch in batches:
            found += (one for one in flow.weigh(batch) if not one.is_remainder)
        return found

    def _lead_in(self) -> None:
        """Process the logs before the job, to start from their open window; their own estimates belong to the job
        before.
        """
        before, first_ns = readable(self._job.lead_in), next((one.facts.first_ns for one in self._job.logs), None)
        if not before or not self._leads_on(before[-1], first_ns):
            return
        for one, next_ns in followed(before, first_ns):
            try:
                self.take(one, next_ns)
            except LogUnreadableError:  # the job that the log belongs to reports it, and what it breaks off
                self.break_off()

    def _leads_on(self, one: JobLog, first_ns: int | None) -> bool:
        """Whether the last log before the job is still under way when it begins, by decoding alone."""
        with one.log.place.fetched(one.log.path) as fetched:
            try:
                motions, _ = motion_of_log(fetched.path, self._job.setup.signal_map)
                newest_ns = max((int(motion.t_ns.max()) for motion in motions if len(motion)), default=None)
            except Exception:  # noqa: BLE001 - a log that cannot be read leads nowhere; its own job reports it
                return False
        return goes_on(newest_ns, first_ns, self._job.settings)


def readable(logs: Sequence[JobLog]) -> list[JobLog]:
    return [one for one in logs if one.facts.first_ns is not None]


def followed(logs: Sequence[JobLog], next_ns: int | None) -> Iterator[tuple[JobLog, int | None]]:
    """Yields each log with the first frame of the log after it; ``next_ns`` follows the last log."""
    return zip(logs, [*(one.facts.first_ns for one in logs[1:]), next_ns], strict=False)  # no logs, none after them


def goes_on(newest_ns: int | None, next_ns: int | None, settings: BatchSettings) -> bool:
    """Whether a log that ends with a row at ``newest_ns`` and one that begins at ``next_ns`` are one recording."""
    if newest_ns is None or next_ns is None:
        return False
    return -settings.clock_step_s * NS_PER_S <= next_ns - newest_ns <= settings.silence_s * NS_PER_S


def _of_the_log(fault: Exception, one: JobLog, path: str) -> Exception:
    """Classify a fault while reading: this computer's, the place's (retry), or the log's (final)."""
    told = str(fault).replace(path, one.log.name)
    if isinstance(fault, MemoryError):
        return fault
    if isinstance(fault, ReaderMissingError):
        return ConfigurationError(told)
    if isinstance(fault, OSError) and fault.errno is not None:
        return PlaceError(f"{one.log.name}: {fault.strerror}")
    if isinstance(fault, LogUnreadableError):
        return LogUnreadableError(told)
    return LogUnreadableError(f"{one.log.name}: cannot be read: {fault!r}")
