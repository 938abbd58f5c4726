"""springscale calibrate --report and evaluate --report, as a person calls them, on a small made-up campaign."""

import json
from collections.abc import Mapping
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from support.commands import run
from support.html_page import Page, assert_self_contained, assert_well_formed
from support.known_load_logs import write_known_loads

from gateway.calibration.file import load_calibration
from gateway.calibration.judgement.advice import GRADE_TEXT
from gateway.cli import main
from gateway.words import decimal, percent

WINDOW = ("--window-s", "100")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """campaign.toml, vehicle.json and report/ of four known loads."""
    directory = tmp_path_factory.mktemp("known")
    campaign = write_known_loads(directory)
    vehicle, report = str(directory / "vehicle.json"), str(directory / "report")
    run("calibrate", str(campaign), "--output", vehicle, "--report", report, *WINDOW)
    return directory


@pytest.fixture(scope="module")
def page(made: Path) -> Page:
    return Page((made / "report" / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def numbers(made: Path) -> dict[str, Any]:
    return dict(json.loads((made / "report" / "report.json").read_text(encoding="utf-8")))


def test_every_section_is_there_and_linked(page: Page) -> None:
    sections = {
        "verdict", "runs", "half-car", "accuracy-cross-spectrum",
        "accuracy-ratio-index", "provenance",
    }  # fmt: skip
    assert sections <= set(page.ids)
    assert {f"#{name}" for name in sections} <= {link for link in page.links if link.startswith("#")}


def test_the_page_is_well_formed_with_all_it_needs_beside_it_and_says_what_its_pictures_show(
    made: Path, page: Page
) -> None:
    assert_well_formed(page)
    assert_self_contained(made / "report" / "report.html")
    assert len(page.alts) == 1 + 2  # of the run that fits worst, and of each estimator
    assert all(len(alt) > 40 for alt in page.alts)
    assert len(set(page.alts)) == len(page.alts)


@pytest.mark.parametrize("estimator", ["cross_spectrum", "ratio_index"])
@pytest.mark.parametrize("part", ["left_one_run_out", "validation", "identification"])
def test_the_tables_say_what_the_numbers_say(page: Page, numbers: Mapping[str, Any], estimator: str, part: str) -> None:
    errors = numbers["errors"][estimator][part]
    payload = errors["payload"]
    in_short = [
        decimal(payload["mean_abs_kg"], " kg"), decimal(payload["bias_kg"], " kg"), decimal(payload["std_kg"], " kg"),
        decimal(payload["max_abs_kg"], " kg"), decimal(payload["mean_abs_pct"]),
    ]  # fmt: skip
    assert any(in_short == row[3:8] for table in page.tables for row in table)
    for one in errors["runs"]:
        cells = [decimal(one["payload"]["mean_abs_kg"], " kg"), decimal(one["payload"]["bias_kg"], " kg")]
        cells += [decimal(one["payload"]["max_abs_kg"], " kg"), percent(one["payload"]["coverage95"])]
        rows = [row for table in page.tables for row in table if row[0] == str(one["run"]) and row[4:8] == cells]
        assert rows


def test_runs_left_out_err_as_the_calibration_file_expects(made: Path, numbers: Mapping[str, Any]) -> None:
    """Digit for digit where every batch was answered; the file counts those, too, that the service would refuse."""
    file = load_calibration(made / "vehicle.json")
    compared = []
    for estimator, expected in file.expected_errors.items():
        errors = numbers["errors"][estimator]["left_one_run_out"]["payload"]
        rms_kg = (errors["bias_kg"] ** 2 + errors["std_kg"] ** 2) ** 0.5
        if errors["mean_abs_pct_with_misses"] == errors["mean_abs_pct"]:
            compared.append(estimator)
            assert rms_kg == pytest.approx(expected.payload_rms_kg, rel=1e-6)
        else:
            assert rms_kg < expected.payload_rms_kg  # what is refused erred more
    assert "ratio_index" in compared


def test_the_verdict_is_of_the_better_estimator_and_gives_its_reasons(numbers: Mapping[str, Any], made: Path) -> None:
    best = numbers["verdicts"][0]
    assert numbers["grade"] == best["grade"]
    assert best["estimator"] == "cross_spectrum"  # the roads of this campaign are just what it supposes
    assert numbers["calibration_id"] == load_calibration(made / "vehicle.json").id
    rules = {reason["rule"] for reason in best["reasons"]}
    assert {"payload_error", "front_share_error", "payload_coverage", "answered"} <= rules
    text = unescape((made / "report" / "report.html").read_text(encoding="utf-8")).replace("\u00a0", " ")
    assert all(reason["text"] in text for verdict in numbers["verdicts"] for reason in verdict["reasons"])


def test_the_budget_says_where_the_stated_error_comes_from(numbers: Mapping[str, Any], page: Page) -> None:
    shown = [table for table in page.tables if table[0][-1] == "what would narrow it"]
    drawn = [[row[1] for row in table[1:]] for table in shown]
    budgets = numbers["error_budget"]
    assert drawn == [[f"{line['payload_kg']:.1f} kg" for line in budgets[name]] for name in numbers["errors"]]
    assert {line["source"] for line in budgets["cross_spectrum"]} >= {"own", "calibration", "day", "model"}
    assert {line["source"] for line in budgets["ratio_index"]} == {"own", "calibration"}  # a regression has no more


def test_without_a_report_the_command_prints_the_verdict(made: Path, numbers: Mapping[str, Any]) -> None:
    done = run("calibrate", str(made / "campaign.toml"), "--output", str(made / "again.json"), *WINDOW)
    grade = next(text for grade, text in GRADE_TEXT.items() if grade == numbers["grade"])
    said = done.stdout[
        done.stdout.index(f"{grade}, by the cross-spectral estimator. Over the drives left out it weighs") :
    ]
    reasons = numbers["verdicts"][0]["reasons"]
    assert [one["text"] in said for one in reasons] == [one["grade"] != "fit" for one in reasons]


def test_an_evaluation_has_a_report_of_its_own(made: Path) -> None:
    told = run(
        "evaluate", str(made / "campaign.toml"), "--calibration", str(made / "vehicle.json"), "--estimator",
        "ratio_index", "--report", str(made / "evaluated"), *WINDOW, "--json",
    )  # fmt: skip
    numbers = json.loads((made / "evaluated" / "report.json").read_text(encoding="utf-8"))
    answer = json.loads(told.stdout)
    verdict = answer.pop("verdict")
    assert numbers["errors"] == {"ratio_index": {"validation": answer}}
    assert verdict["grade"] in set(GRADE_TEXT)
    page = Page((made / "evaluated" / "report.html").read_text(encoding="utf-8"))
    assert {"verdict", "accuracy-ratio-index", "provenance"} <= set(page.ids)
    assert not {"half-car", "runs"} & set(page.ids)


def test_a_report_is_not_written_over_a_file(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["evaluate", str(made / "campaign.toml"), "--calibration", str(made / "vehicle.json")]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--report", str(made / "vehicle.json"), *WINDOW])
    assert ended.value.code == 2
    assert "no report can be written there" in capsys.readouterr().err


def reported(folder: Path, **known: Any) -> tuple[dict[str, Any], Page]:
    """The numbers and the page of a calibration on these known loads."""
    report = folder / "report"
    campaign = write_known_loads(folder, **known)
    run("calibrate", str(campaign), "--output", str(folder / "v.json"), "--report", str(report), *WINDOW)
    page = Page((report / "report.html").read_text(encoding="utf-8"))
    return json.loads((report / "report.json").read_text(encoding="utf-8")), page


def test_one_load_without_validation_reports_what_there_is(tmp_path: Path) -> None:
    numbers, page = reported(tmp_path, loads=((0.0, None),), identification_fraction=1.0)
    assert numbers["grade"] != "fit"  # it knows the zero, and says itself how little of the rest
    assert {"unseen", "springs_from_priors"} <= {r["rule"] for r in numbers["verdicts"][0]["reasons"]}
    assert list(numbers["errors"]) == ["cross_spectrum"]
    assert list(numbers["errors"]["cross_spectrum"]) == ["identification"]
    assert {"half-car", "accuracy-cross-spectrum"} <= set(page.ids)


def test_one_sensor_reports_what_it_can(tmp_path: Path) -> None:
    """Without a pitch rate the ratio index alone answers, and of the payload alone."""
    numbers, page = reported(tmp_path, has_pitch_rate=False)
    assert list(numbers["errors"]) == ["ratio_index"]
    assert numbers["errors"]["ratio_index"]["left_one_run_out"]["front_share"]["mean_abs_pct"] is None
    reasons = {reason["rule"]: reason["grade"] for reason in numbers["verdicts"][0]["reasons"]}
    assert reasons["front_share_error"] == "fit_with_reservations"
    assert "accuracy-ratio-index" in page.ids


def test_its_charts_fit_a_phone(made: Path, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page.goto((made / "report" / "report.html").as_uri())
    page.wait_for_function("[...document.images].every((one) => one.complete && one.naturalWidth > 0)")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.close()
