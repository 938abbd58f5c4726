"""Cases of the studies are kept: a study that was broken off goes on where it stopped."""

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.accuracy import __main__ as command
from benchmarks.accuracy import coverage
from benchmarks.accuracy import study as study_module
from benchmarks.accuracy.coverage_table import JudgedBatch
from benchmarks.accuracy.study import Study


def run(*arguments: str) -> str:
    found = CliRunner().invoke(command.studies, list(arguments), catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.stdout


N_COMPUTED: list[int] = []


def counted_case(seed: int, number: int) -> list[JudgedBatch]:
    N_COMPUTED.append(number)
    return [JudgedBatch("van", f"run {number}", "mixed", "cross_spectrum", ("gap",), 1.0 + seed, 2.0, True, False)]


def test_a_study_that_was_broken_off_resumes_with_the_finished_cases(tmp_path: Path) -> None:
    """The cases that were read are those that were computed, NaN included."""
    study = replace(coverage.STUDY, of_case=counted_case)
    N_COMPUTED.clear()
    first = study.cases(2, 5, kept=tmp_path)
    again = study.cases(3, 5, kept=tmp_path)
    assert N_COMPUTED == [0, 1, 2]
    assert repr(again[:2]) == repr(first)
    assert repr(study.cases(3, 5)) == repr(again)
    assert {path.name for path in tmp_path.iterdir()} == {f"coverage-5-{number}.json" for number in range(3)}
    assert study.cases(1, 6, kept=tmp_path)[0][0].payload_error_pct == 7.0  # another seed is another case


@pytest.mark.parametrize("study", command.STUDIES, ids=[study.name for study in command.STUDIES])
def test_every_study_can_store_its_cases(study: Study) -> None:
    assert isinstance(study_module._adapter_of(study.of_case).json_schema(), dict)
