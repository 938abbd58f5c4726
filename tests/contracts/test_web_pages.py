"""The pages' files: a policy that lets nothing foreign in, and a library that browsers fetch once."""

import gzip
import re
from pathlib import Path
from urllib.parse import urljoin

import pytest
from support.web import Client, Gateway, below

from gateway.estimates.reasons import EXPLANATIONS, REMEDIES, SOURCES
from gateway.records import Why, iso_utc
from gateway.web.pages import LIBRARY, LIBRARY_URL
from gateway.web.routes.weights import KnownLoadTold

NAMED = re.compile(r"(?:<link[^>]* href=|src=|chart-library=|from )\"([^\"]*)\"")
PREFIX = "/fleet/van-17"  # a path of a proxy
ROW = re.compile(r"^  (\S+): \[\s*\"(.*?)\",\s*\"(.*?)\",?\s*\],$", re.MULTILINE)
TRUTH = tuple(
    KnownLoadTold(t_start=iso_utc(t_ns), payload_kg=kg, front_share_pct=pct)
    for t_ns, kg, pct in ((0, 0.0, 50.0), (900 * 10**9, 270.0, 50.6))
)


def test_the_policy_forbids_foreign_and_inline_code(client: Client) -> None:
    for path in ("/", "/cab", "/api/v1/status", "/assets/dashboard/main.js", "/nothing"):
        policy = client.get(path).headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "http" not in policy


def test_only_the_api_documentation_may_write_styles(client: Client) -> None:
    answer = client.get("/docs")
    policies = answer.headers.get_list("content-security-policy")
    assert len(policies) == 1
    assert "style-src 'self' 'unsafe-inline'" in policies[0]
    assert "script-src 'self';" in policies[0]


@pytest.mark.parametrize("path", ["/", "/engineer", "/cab", "/docs"])
def test_the_page_holds_no_script_and_no_style_of_its_own(client: Client, path: str) -> None:
    page = client.get(path).text
    assert re.findall(r"<script(?![^>]*\bsrc=)", page) == []
    assert re.findall(r"<style|\sstyle=|\son[a-z]+=", page) == []
    assert re.findall(r"(?:src|href)=\"(?:/|[a-z]+:)[^\"]*", page) == []  # relative ones work below the path of a proxy


@pytest.mark.parametrize(
    ("path", "tables"),
    [
        ("/cab", ("common", "cab")),
        ("/", ("common", "dashboard")),
        ("/engineer", ("common", "dashboard")),
        ("/teach", ("common", "teach")),
    ],
)
def test_every_phrase_is_translated(client: Client, path: str, tables: tuple[str, ...]) -> None:
    """A row per phrase; English and German have the same fields; what a page names has a row."""
    rows: dict[str, tuple[str, str]] = {}
    for table in tables:
        text = client.get(f"/assets/words/{table}.js").text
        found = ROW.findall(text)
        assert len(found) == len(re.findall(r"^  \S.*: \[", text, re.MULTILINE))
        rows |= {key.strip('"'): (english, german) for key, english, german in found}
    for english, german in rows.values():
        assert set(re.findall(r"{\w+}", english)) == set(re.findall(r"{\w+}", german))
        assert english.count("|") == german.count("|")
    named = re.findall(r'data-say(?:-label)?="(\w+)"', client.get(path).text)
    assert len(named) > 5
    assert set(named) <= set(rows)


def test_german_has_every_reason_source_and_remedy(client: Client) -> None:
    german = client.get("/assets/words/reasons.js").text
    for names in (EXPLANATIONS, SOURCES, REMEDIES):
        assert [str(name) for name in names if not re.search(rf"^  {name}: ", german, re.MULTILINE)] == []
    common = client.get("/assets/words/common.js").text
    assert [str(name) for name in EXPLANATIONS if f'"reason.{name}"' not in common] == []


@pytest.mark.parametrize("path", ["/", "/engineer", "/cab"])
def test_ids_are_unique_in_a_page(client: Client, path: str) -> None:
    """Two parts of the dashboard had one, and a script filled the first that it found."""
    ids = re.findall(r'\sid="([^"]+)"', client.get(path).text)
    assert len(ids) > 10
    assert sorted(ids) == sorted(set(ids))


def loaded(client: Client, page: str) -> dict[str, bytes]:
    """The files that a browser loads for a page, by path, with the modules that each imports."""
    found, waiting = {}, [page]
    while waiting:
        path = waiting.pop()
        answer = client.get(path)
        assert answer.status_code == 200, path
        found[path] = answer.content
        is_ours = path == page or (path.endswith(".js") and "/assets/" in path and "plotly" not in path)
        names = NAMED.findall(answer.text) if is_ours else []
        waiting += {urljoin(path, name) for name in names} - found.keys() - set(waiting)
    return found


@pytest.mark.parametrize("prefix", ["", PREFIX])
@pytest.mark.parametrize(
    ("path", "one"),
    [
        ("/", LIBRARY_URL),
        ("/engineer", LIBRARY_URL),
        ("/cab", "/assets/cab/cab.js"),
        ("/docs", "/swagger/swagger-ui.css"),
    ],
)
def test_every_file_that_a_page_names_exists(client: Client, path: str, one: str, prefix: str) -> None:
    """They must also exist below the path of a proxy, which cuts it off."""
    behind = Client(below(prefix, client.app)) if prefix else client
    assert prefix + one in loaded(behind, prefix + path)


def test_scripts_ask_for_routes_relative_to_the_page(client: Client) -> None:
    """An absolute one would leave the path of a proxy."""
    paths = {path for page in ("/", "/engineer", "/cab") for path in loaded(client, page) if path.endswith(".js")}
    paths = {path for path in paths if "plotly" not in path and "/words/" not in path}
    asked = [text for path in paths for text in re.findall(r"[\"`]/(?:api|assets)/", client.get(path).text)]
    assert asked == []
    assert "api/v1/status" in client.get("/assets/dashboard/feed.js").text


def test_the_cab_page_is_small_with_all_that_it_loads(client: Client) -> None:
    """A cheap phone on a slow link: 40 kB before compression, less than a tenth of one photograph."""
    files = loaded(client, "/cab")
    assert {path.rpartition(".")[2] for path in files} == {"/cab", "css", "js", "svg"}
    assert sum(map(len, files.values())) < 40_000


def test_the_library_is_served_from_the_installed_package(client: Client) -> None:
    plain = client.get(LIBRARY_URL, headers={"accept-encoding": "identity"})
    packed = client.get(LIBRARY_URL, headers={"accept-encoding": "gzip"})
    assert plain.content == packed.content == LIBRARY.read_bytes()
    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert len(gzip.compress(plain.content, 6)) == pytest.approx(int(packed.headers["content-length"]), rel=0.01)


def test_a_browser_keeps_the_library_and_asks_about_the_page(client: Client) -> None:
    kept = client.get(LIBRARY_URL).headers
    assert "immutable" in kept["cache-control"]
    assert kept["vary"] == "accept-encoding"
    assert client.get("/").headers["cache-control"] == "no-cache"
    assert client.get("/assets/dashboard/main.js").headers["cache-control"] == "no-cache"


def test_known_true_loads_are_shown(tmp_path: Path) -> None:
    with Gateway(tmp_path, known_loads=lambda: TRUTH) as gateway:
        client = Client(gateway.app)
        assert 'data-known-loads="api/v1/known-loads"' in client.get("/").text
        assert client.get("/api/v1/known-loads").json()["items"] == [
            {"t_start": "1970-01-01T00:00:00.000000Z", "payload_kg": 0.0, "front_share_pct": 50.0},
            {"t_start": "1970-01-01T00:15:00.000000Z", "payload_kg": 270.0, "front_share_pct": 50.6},
        ]


def test_a_service_on_the_road_has_no_true_loads(client: Client) -> None:
    assert 'data-known-loads=""' in client.get("/").text
    assert client.get("/api/v1/known-loads").status_code == 404


def test_every_reason_has_a_sentence(client: Client) -> None:
    reasons = client.get("/api/v1/reasons").json()["reasons"]
    assert set(reasons) == set(Why)
    assert all(told["happened"] and told["advice"] for told in reasons.values())
