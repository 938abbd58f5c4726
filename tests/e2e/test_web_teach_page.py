"""The page that teaches a vehicle, as somebody uses it who has just connected the box."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from support.browser import expect
from support.cab import BEFORE
from support.dashboard import Watched
from support.learner import ANSWERS, LearnerBench, at
from support.sentences import raised, unmet
from support.web import Gateway, serving

from gateway.calibration.inspection.finding import Kind, Severity
from gateway.calibration.learning.from_pieces import LOOKED_FOR, _nothing
from gateway.calibration.learning.told import SLIPS
from gateway.calibration.statements_csv import read_statements
from gateway.service.learner.said import NEXT_FIT, NO_VEHICLE
from gateway.stated.doubt import DoubtKind
from gateway.stated.facts import VehicleAnswers
from gateway.web.access.tokens import Scope, TokenFile

MOST_CLICKS, MOST_NUMBERS = 12, 8
VAN = {
    "kerb_front_axle_kg": "690",
    "kerb_rear_axle_kg": "710",
    "wheelbase_m": "2.75",
    "sensor_position_m": "1.2",
    "gross_limit_kg": "2000",
    "front_axle_limit_kg": "1000",
    "rear_axle_limit_kg": "1100",
}


@pytest.fixture
def bench(tmp_path: Path) -> LearnerBench:
    return LearnerBench(tmp_path / "learner")


@contextmanager
def read_in(browser: Any, page: Any, locale: str, **more: Any) -> Iterator[Any]:
    """The same page as somebody with this locale opens it."""
    other = browser.new_page(locale=locale, **more)
    other.goto(page.url)
    yield other
    other.close()


@pytest.fixture
def page(browser: Any, tmp_path: Path, bench: LearnerBench) -> Iterator[Any]:
    """The page of a gateway that knows nothing yet."""
    watched = Watched(browser, color_scheme="light")
    with Gateway(tmp_path / "store", learner=bench.learner) as gateway, serving(gateway.app) as server:
        gateway.status = BEFORE.model_copy(update={"calibration_id": None})
        watched.page.goto(f"{server.url}/teach")
        yield watched.page
        watched.page.close()
        gateway.board.close()
    assert watched.complaints == []


def test_from_nothing_to_the_drive_it_takes_few_clicks(page: Any, bench: LearnerBench) -> None:
    """Every number is typed into a field that was clicked; then the van is stated, and stated empty."""
    expect(page.locator("#now")).to_have_text("Next: state the van below.")
    n_clicks = n_numbers = 0
    for name, number in VAN.items():
        page.locator(f"#{name}").click()
        page.keyboard.type(number)
        n_clicks, n_numbers = n_clicks + 1, n_numbers + 1
    page.get_by_role("button", name="State the van").click()
    expect(page.locator("#now")).to_have_text("Next: drive. Ordinary drives are enough.")
    page.get_by_role("button", name="It is empty").click()
    expect(page.locator("#statements tr")).to_have_count(1)
    expect(page.locator("#statements")).to_contain_text("waits")
    assert n_clicks + 2 <= MOST_CLICKS
    assert n_numbers <= MOST_NUMBERS
    bench.drive(0)
    expect(page.locator("#driven")).to_have_text("5 min of driving kept, 1 drive")
    page.get_by_role("button", name=re.compile("^Withdraw: .*, empty")).click()
    expect(page.locator("#statements")).to_contain_text("withdrawn")
    page.get_by_label("Kilograms").fill("310")
    page.get_by_role("button", name="That is aboard").click()
    expect(page.locator("#statements")).to_contain_text("310 kg")


def test_a_place_before_the_front_axle_is_a_number_and_a_length_is_not_negative(page: Any) -> None:
    page.locator("#van details summary").click()
    for name, is_valid in (("sensor_position_m", True), ("sensor_offset_left_m", True), ("wheelbase_m", False)):
        field = page.locator(f"#{name}")
        field.fill("-0.4")
        assert field.input_value() == "-0.4"
        assert field.evaluate("field => field.checkValidity()") is is_valid


@pytest.mark.parametrize(
    ("locale", "told"),
    [
        ("en", "Wheelbase [m]: 2750 is above 20: millimetres?"),
        ("de", "Radstand [m]: 2750 ist größer als 20: Millimeter?"),
    ],
)
def test_a_number_in_another_unit_is_named_by_its_field(browser: Any, page: Any, locale: str, told: str) -> None:
    with read_in(browser, page, locale) as shown:
        expect(shown.locator("#now")).to_be_visible()
        for name, number in {**VAN, "wheelbase_m": "2750"}.items():
            shown.locator(f"#{name}").fill(number)
        shown.locator("#van > button").click()
        expect(shown.locator("#fault")).to_have_text(told)
        expect(shown.locator("#fault")).to_be_in_viewport()


def test_a_locked_page_asks_for_the_token(browser: Any, tmp_path: Path, bench: LearnerBench) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    token = tokens.create("fitter", Scope.OPERATE)
    page = browser.new_page(locale="en")
    with Gateway(tmp_path / "store", tokens=tokens, learner=bench.learner) as gateway, serving(gateway.app) as server:
        page.goto(f"{server.url}/teach")
        expect(page.get_by_role("alert")).to_have_text("The gateway needs a token.")
        expect(page.locator("#main")).to_be_hidden()
        page.get_by_label("Token").fill(token)
        page.get_by_role("button", name="Show the vehicle").click()
        expect(page.locator("#now")).to_have_text("Next: state the van below.")
        expect(page.locator("#token")).to_be_hidden()
        page.close()
        gateway.board.close()


def test_a_statement_can_be_withdrawn_on_a_phone_without_scrolling_sideways(
    browser: Any, page: Any, bench: LearnerBench
) -> None:
    page.get_by_role("button", name="It is empty").click()
    with read_in(browser, page, "en", viewport={"width": 360, "height": 740}) as phone:
        remove = phone.locator("#statements button")
        remove.scroll_into_view_if_needed()
        box = remove.bounding_box()
        assert box["x"] >= 0.0
        assert box["x"] + box["width"] <= 360.0
        remove.click()
        expect(phone.locator("#statements")).to_contain_text("withdrawn")


def learn_two_drives(bench: LearnerBench) -> None:
    """Both look empty, and a weighing would help."""
    bench.learner.van.state(VehicleAnswers(**ANSWERS), "workshop", is_confirmed=False)
    bench.drive(0)
    bench.turn()
    drives = tuple({"number": n + 1, "t_start": at(600 * n), "t_end": at(600 * n + 300)} for n in range(2))
    helps = [{"do": "scale", "then_plus_minus_kg": 17.0, "text": "a large load on a weighbridge: ± 40 kg ..."}]
    learning = {"plus_minus_kg": 40.0, "useful_at_kg": 150.0, "tested_on": 3, "helps": helps, "findings": []}
    bench.finish(drives=drives, looks_empty=(1, 2), learning=learning)


def test_what_helps_is_said_once_and_a_no_takes_the_question_away(page: Any, bench: LearnerBench) -> None:
    learn_two_drives(bench)
    expect(page.locator("#questions")).to_contain_text("These 2 drives look empty", timeout=15_000)
    expect(page.locator("#helps li")).to_have_text(["a large load on a scale: then ± 17 kg"])
    page.get_by_role("button", name="No: These").click()
    expect(page.locator("#questions-card")).to_be_hidden()
    assert json.loads(bench.learner.loads.page())["items"] == []


@pytest.mark.parametrize(
    ("locale", "typed", "is_valid"),
    [("de-DE", "1240,5", True), ("de-DE", "1240.5", True), ("de-DE", "1.240,5", False), ("en-GB", "1,240.5", False)],
)
def test_a_decimal_comma_is_a_comma_in_german_and_refused_in_english(
    page: Any, browser: Any, locale: str, typed: str, is_valid: bool
) -> None:
    """A field of type "number" made 15 of a typed "1,5" where the browser itself is English."""
    with read_in(browser, page, locale) as other:
        field = other.locator("#aboard-kg")
        expect(field).to_be_visible()  # a key that is pressed before goes elsewhere
        field.press_sequentially(typed)
        assert field.evaluate("field => field.validity.valid") == is_valid
        if is_valid:
            with other.expect_request(lambda asked: asked.method == "POST") as sent:
                field.press("Enter")
            assert sent.value.post_data_json["load"] == {"payload_kg": 1240.5}


def test_a_vehicle_of_the_same_model_is_handed_in_and_taken_back(page: Any) -> None:
    page.get_by_text("More", exact=True).click()
    shipped = Path(str(files("gateway"))) / "demo" / "paper_van.json"
    page.locator("#sister-file").set_input_files(shipped)
    expect(page.locator("#sister")).to_contain_text("Learning begins with what is known of")
    page.locator("#sister").get_by_role("button").click()
    expect(page.locator("#sister")).to_be_hidden()


ENGLISH = re.compile(r"\b(the|and|is|are|of|then|drive|vehicle|statement|load|with|from|it)\b")
COLUMN = re.compile(r"^(from|load|vehicle): | from$")
WITHOUT_NUMBERS = re.compile(r"\{\w+(:[^}]*)?\}")
ROOT = Path(__file__).parents[2]


TABLES = (
    "from;payload_kg;price\n26.11.2026 07:40;310;7\n",
    "from;payload_kg\n;310\n46352;310\nyesterday;310\n2026-13-26;310\n2026-11-26;310;7\n1926-11-26T07:40Z;310\n2026-11-26T07:40Z;\n",
    "from;payload_kg;gross_kg\n2026-11-26T07:40Z;310;1890\n2026-11-26T07:40Z;-310;\n2026-11-26T07:40Z;1000000;\n",
    "from;front_axle_kg\n2026-11-26T07:40Z;900\n",
    "from;payload_kg;plus_minus_kg\n2026-11-26T07:40Z;310;0\n",
    "from;until;payload_kg\n2026-11-26T07:40Z;2026-11-25T07:40Z;310\n",
    "from;source;payload_kg\n2026-11-26T07:40Z;empty;310\n2026-11-26T07:40Z;scales;310\n2026-11-26T07:40Z;x;310\n",
    "from;source;gross_kg\n2026-11-26T07:40Z;axle_scales;1000\n",
)


def sentences() -> Iterator[str]:
    """Sentences of the gateway: of unlikely figures, of false statements as recorded drives met them, of versions."""
    for kind in DoubtKind:
        yield WITHOUT_NUMBERS.sub("12.5", kind.text)
        yield kind.advice
    found = json.loads((ROOT / "docs" / "false_statements.json").read_text(encoding="utf-8"))
    for one in (*found["kinds"], *found["all"]):
        for asked in one["asked"]:
            if not asked.startswith("place.behind_front_axle_m: Input"):  # of a field that cannot be sent at all
                yield f"drive 3 {asked}" if asked.startswith("says ") else asked
    yield "LS-4711: drive 3 says 20 kg, the drive shows 270 ± 30 kg: was something aboard?"
    for meant, _ in SLIPS:
        yield f"LS-4711: drive 3 says 20 kg, the drive shows 270 ± 30 kg: is it {meant}? then 200 kg were aboard"
    yield "the statement from 2026-11-26T07:40Z: drive 3 says 20 kg, the drive shows 3 ± 9 kg: was something aboard?"
    yield "LS-1: drive 3 says 20 kg, the drive shows 3 ± 9 kg: is it the gross weight? then write gross_kg"
    yield "The drive of 2026-11-26T07:40Z looks empty. Is that right?"
    yield "These 2 drives look empty (2026-11-26T07:40Z, 2026-11-26T09:40Z). Is that right?"
    for end in ("One weighing on a scale tells", "The scale is allowed for"):
        packaging = f"is it packaging, or what is always in the vehicle? {end}"
        yield from (f"all delivery notes say 8 ± 5 % {off} than is aboard: {packaging}" for off in ("less", "more"))
    yield from ("replaced by a later one with the ref A", "withdrawn by office, 2026-11-26T07:40Z")
    yield "of the same time as that from 2026-11-26T07:40Z, that from 2026-11-26T07:41Z"
    yield "vehicle: van-18: this one is another"
    yield from raised()
    yield from ("write gross_kg if that is the whole vehicle", "is it in pounds, or another vehicle's?")
    for table in TABLES:
        told = read_statements(table.encode(), "")
        yield from told.notes
        yield from (fault.partition(": ")[2] for faults in told.faults.values() for fault in faults)
    yield _nothing({})
    yield "nothing to learn from: every drive has a fault: 12.5"
    yield "sensor_position_m: 35 is above 30"
    for unit in ("millimetres", "centimetres", "tonnes"):
        yield from (f"2750 is {beyond} 20: {unit}?" for beyond in ("above", "below"))
    yield "learning was killed: the machine has not enough memory for it, or somebody ended it; it begins anew"
    yield "learning left the result of another job: it was killed, and begins anew"
    yield from ("learning took longer than 1800 s and was ended", "learning needs more than 300 MB")
    yield "[learning] is_allowed = false: calibrations come by file"
    yield from ("1 drive and 0 statements: ± 62 kg", "1 drive and 1 statement", "2 drives and 0 statements")
    yield "2 drives and 1 statement: ± 62 kg became ± 34 kg; not used: reasons"
    worse = "it predicts the loads of 4 drives that were left out worse than the calibration before it"
    yield f"14 drives and 3 statements: ± 62 kg became ± 34 kg; not used: {worse}"
    yield from (NO_VEHICLE, NEXT_FIT)


def test_every_sentence_of_the_gateway_is_german_for_germans(page: Any, browser: Any) -> None:
    with read_in(browser, page, "de-DE") as german:
        texts = sorted(set(sentences()))
        told = german.evaluate(
            "texts => import('./assets/teach/translated.js').then(m => texts.map(m.translated))", texts
        )
        assert [text for text in told if ENGLISH.search(COLUMN.sub("", text))] == []
        said = german.evaluate("() => import('./assets/words/said.js').then(m => m.SAID.map(([english]) => english))")
        assert unmet(said, texts) == []
        faults = [kind.advice for kind in Kind if kind in LOOKED_FOR and Severity.FAULT in kind.severities]
        rows = german.evaluate("() => import('./assets/words/said.js').then(m => m.LEFT_OUT)")
        assert sorted(english for english, _ in rows) == sorted(faults)
        assert [text for _, text in rows if ENGLISH.search(text)] == []


def test_the_page_speaks_german_of_what_was_learnt_and_is_asked(page: Any, browser: Any, bench: LearnerBench) -> None:
    learn_two_drives(bench)
    with read_in(browser, page, "de-DE") as german:
        expect(german.locator("#helps li")).to_have_text(["eine große Ladung auf einer Waage: dann ± 17 kg"])
        expect(german.locator("#versions li")).to_have_text(re.compile("^2 Fahrten und 0 Angaben: ± 40 kg"))
        expect(german.locator("#questions")).to_contain_text("Diese 2 Fahrten sehen leer aus")
        assert [line for line in german.locator("main").inner_text().splitlines() if ENGLISH.search(line)] == []


@pytest.mark.parametrize(
    ("locale", "shown"),
    [("de-DE", "Die Fahrt von 26. Nov., 08:40 sieht"), ("en-GB", "The drive of 26 Nov, 08:40 looks")],
)
def test_times_in_sentences_are_those_of_the_readers_place(page: Any, browser: Any, locale: str, shown: str) -> None:
    other = browser.new_page(locale=locale, timezone_id="Europe/Berlin")
    other.clock.set_fixed_time("2026-12-24T12:00:00Z")
    other.goto(page.url)
    asked = "The drive of 2026-11-26T07:40Z looks empty. Is that right?"
    told = other.evaluate("text => import('./assets/teach/translated.js').then(m => m.translated(text))", asked)
    other.close()
    assert told.startswith(shown)


def test_rows_that_cannot_be_read_are_told_in_german(page: Any, browser: Any) -> None:
    with read_in(browser, page, "de-DE") as german:
        table = b"from;payload_kg;price\nsofort;310;7\n2026-11-26 08:40;viel;7\n2026-11-26 08:40;300;7\n"
        german.locator("#import-file").set_input_files({"name": "n.csv", "mimeType": "text/csv", "buffer": table})
        german.get_by_role("button", name="Einlesen").click()
        expect(german.locator("#import-problems li")).to_have_text([
            "Spalten, die nicht gelesen werden: price",
            "Zeile 2: from: sofort: keine Zeit; so schreiben: 2026-11-26 07:40",
            "Zeile 3: payload_kg: viel: keine Zahl: in kg angeben, etwa 310 oder 12,5",
            re.compile("^Zeile 4: das Fahrzeug ist noch nicht bekannt"),
        ])  # fmt: skip
