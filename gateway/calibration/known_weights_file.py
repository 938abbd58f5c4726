"""known_weights.json: every weight that somebody made known, the newest last, and what became of it.

It lies beside the database, apart from the calibration file, which no known weight changes. What they teach is computed
from the list (core.known_weights), so that each can be taken back. Written by the service alone, in one step.
"""

from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from gateway.calibration.file.calibration_file import content_id
from gateway.calibration.file.parts import Part
from gateway.core.known_weights import Knowledge, Observation
from gateway.errors import ConfigurationError
from gateway.estimate_json import posterior_from_json
from gateway.files.kept import KeptFiles
from gateway.records import ns_of
from gateway.stated import Confirmation, Ending, KnownWeightFields
from gateway.toml_file import describe_faults

FILE_NAME: Final = "known_weights.json"
MOST_KNOWN_WEIGHTS: Final = 200  # the oldest that were taken back are forgotten beyond


class KnownWeight(KnownWeightFields):
    """A known weight with the load it is of as it was measured: what the file keeps.

    ``id`` is the hash of all but its confirmation and its end.
    """

    posterior: dict[str, Any] = Field(description="the load as measured, before any known weight")

    def content_id(self) -> str:
        """What ``id`` has to be."""
        return content_id(self.model_dump(mode="json", exclude={"id", "confirmed", "ended"}))

    @property
    def observation(self) -> Observation:
        """The same in the core's terms."""
        truth, std = [self.payload_kg], [self.payload_std_kg]
        if self.front_share_pct is not None and self.front_share_std_pct is not None:
            truth.append(self.front_share_pct)
            std.append(self.front_share_std_pct)
        return Observation(
            id=self.id,
            t_ns=ns_of(self.t_end),
            calibration_id=self.calibration_id,
            estimator=self.estimator,
            posterior=posterior_from_json(self.posterior),
            truth=np.array(truth),
            truth_covariance=np.diag(np.square(std)),
        )

    @property
    def is_held(self) -> bool:
        """True where its estimate contradicts it and nobody has confirmed it: it teaches nothing yet."""
        return self.ended is None and self.confirmed is None and self.is_contradicted

    @property
    def teaches(self) -> bool:
        """Whether estimates take it into account."""
        return self.ended is None and not self.is_held


class KnownWeights(Part):
    """All that is remembered, oldest first."""

    format: Literal["springscale-known-weights"] = "springscale-known-weights"
    version: Literal[1] = 1
    entries: tuple[KnownWeight, ...] = ()

    def of(self, calibration_id: str | None, estimator: str) -> tuple[KnownWeight, ...]:
        """Those that teach something of this calibration and estimator."""
        wanted = (calibration_id, estimator)
        return tuple(one for one in self.entries if (one.calibration_id, one.estimator) == wanted and one.teaches)

    def knowledge(self, calibration_id: str | None, estimator: str) -> Knowledge | None:
        """What they teach together; None: nothing."""
        return Knowledge.of([one.observation for one in self.of(calibration_id, estimator)])

    def as_of(self, t_ns: int) -> "KnownWeights":
        """As they stood at that time: later entries, confirmations and ends are not there yet."""

        def then(moment: Confirmation | Ending | None) -> bool:
            return moment is not None and ns_of(moment.at) < t_ns

        entries = tuple(
            one.model_copy(
                update={
                    "confirmed": one.confirmed if then(one.confirmed) else None,
                    "ended": one.ended if then(one.ended) else None,
                }
            )
            for one in self.entries
            if ns_of(one.at) < t_ns
        )
        return self.model_copy(update={"entries": entries})

    @model_validator(mode="after")
    def _is_unchanged(self) -> "KnownWeights":
        changed = [entry.id for entry in self.entries if entry.id != entry.content_id()]
        if changed:
            raise ValueError(f"known weight {changed[0]} was changed after it was written")
        return self

    def with_entry(self, entry: KnownWeight) -> "KnownWeights":
        """With one more; those that stand are never forgotten."""
        ended = [one.id for one in self.entries if one.ended is not None]
        forgotten = set(ended[: max(0, len(self.entries) + 1 - MOST_KNOWN_WEIGHTS)])
        kept = tuple(one for one in self.entries if one.id not in forgotten)
        return self.model_copy(update={"entries": (*kept, entry)})

    def changed(self, entry_id: str, **update: Any) -> "KnownWeights":
        """With one entry confirmed or ended."""
        entries = tuple(one.model_copy(update=update) if one.id == entry_id else one for one in self.entries)
        return self.model_copy(update={"entries": entries})


def load_known_weights(path: Path) -> KnownWeights:
    """The file's entries, none where there is no file yet. Raises ConfigurationError for a file that is none."""
    try:
        return known_weights_of(KeptFiles(path.parent).read(path.name), path)
    except FileNotFoundError:
        return KnownWeights()
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None


def known_weights_of(content: bytes, path: Path | str) -> KnownWeights:
    """What such a file holds. Raises ConfigurationError, naming ``path``, where it cannot be believed."""
    try:
        return KnownWeights.model_validate_json(content)
    except ValidationError as fault:
        raise ConfigurationError(
            f"{describe_faults(path, fault, KnownWeights)}: restore it, or remove it to go on without known weights"
        ) from None
