"""python -m benchmarks.accuracy: what is printed and written, with stand-ins for the minutes of work."""

import json
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


@pytest.mark.parametrize(
    ("n_missed", "verdict"), [(0, "agrees with 90 to 99 %"), (100, "too narrow, the limits lie below 90 to 99 %")]
)
def test_the_coverage_study_reports_a_shortfall(
    n_missed: int, verdict: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {"payload_half_width_pct": 3.0, "payload_score_pct": 6.5}
    batches = [
        JudgedBatch("a", f"a {i}", "mixed", "cross_spectrum", (), 1.0, 1.0, i >= n_missed, i % 20 > 0, **told)
        for i in range(200)
    ]
    refused = [
        JudgedBatch("b", "b 1", "mixed", name, ("gap",), 9.0, 9.0, False, False)
        for name in ("cross_spectrum", "ratio_index")
    ]
    monkeypatch.setattr(Study, "cases", lambda *_, **__: [([*batches, *refused], [])])
    page = run("coverage", "--output", str(tmp_path / "out"))
    assert f"cross spectrum, with roll rate, all drives, payload: {100 - n_missed // 2} %" in page
    assert verdict in page
    assert "| mixed, with roll rate | none / none | **1.0 / 1.0** |" in page
    assert "| 3.0 / none | 6 (6) / none | 1 of 201 |" in page
    assert json.loads((tmp_path / "out/coverage.json").read_text(encoding="utf-8"))["vans"] == ["a", "b"]


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
