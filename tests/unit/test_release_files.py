"""What a release says of itself agrees: one version, a valid citation, an image whose files and commands exist."""

import json
import re
import shlex
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from importlib.metadata import version
from pathlib import Path

import make_deb
import pytest
import yaml
from support.locks import ROOT, pins
from support.patience import PATIENCE_S

from gateway.web.access.guard import PUBLIC_PATHS

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
IMAGE = (ROOT / "deploy/container/Containerfile").read_text()
INSTRUCTIONS = re.findall(r"^([A-Z]+) ((?:.*\\\n)*.*)$", IMAGE, re.MULTILINE)


def of(instruction: str) -> list[str]:
    """What follows each of its occurrences in the image's definition, on one line."""
    return [re.sub(r"\\\n\s*", "", rest) for name, rest in INSTRUCTIONS if name == instruction]


def test_there_is_one_version() -> None:
    command = [sys.executable, "-m", "gateway", "--version"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout
    assert said.split()[-1] == PROJECT["version"] == version("springscale") == make_deb.version()
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == PROJECT["version"]


def test_the_citation_is_valid() -> None:
    command = ["check_jsonschema", "--builtin-schema", "vendor.citation-file-format", str(ROOT / "CITATION.cff")]
    checked = subprocess.run(
        [sys.executable, "-m", *command], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert checked.returncode == 0, checked.stdout


def test_hooks_before_a_commit_fetch_nothing_and_call_what_is_locked() -> None:
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local"
    called = {Path(hook["entry"].split()[0]) for hook in repository["hooks"]}
    assert {path.parent for path in called} == {Path(".venv/bin")}
    assert {hook["language"] for hook in repository["hooks"]} == {"system"}
    packages = {"import-linter" if path.name == "lint-imports" else path.name for path in called}
    assert packages <= pins("requirements-dev.txt").keys()


def test_the_image_copies_what_is_there_and_not_ignored() -> None:
    kept = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    copied = [source for copy in of("COPY") if "--from" not in copy for source in copy.split()[:-1]]
    assert len(copied) > 5
    assert [source for source in copied if not (ROOT / source).exists()] == []
    assert [source for source in copied if not any(fnmatch(source, pattern) for pattern in kept)] == []


def test_the_image_installs_nothing_without_a_hash() -> None:
    commands = [part for run in of("RUN") for part in re.split(r"\s*&&\s*", run) if re.search(r"pip\b.* install", part)]
    assert len(commands) == 3
    assert [each for each in commands if "--require-hashes" not in each and "--no-index" not in each] == []
    (wheel,) = [part for run in of("RUN") for part in re.split(r"\s*&&\s*", run) if "pip wheel" in part]
    assert {"--no-deps", "--no-build-isolation"} <= set(shlex.split(wheel))


def test_the_image_runs_the_service_as_nobody_in_particular() -> None:
    names = [name for name, _ in INSTRUCTIONS]
    assert names.index("USER") < names.index("ENTRYPOINT")
    (user,) = of("USER")
    uid = int(user.partition(":")[0])
    assert uid > 0
    assert f"--uid {uid} " in " ".join(of("RUN"))


def test_the_image_starts_a_command_that_exists_and_asks_an_address_that_answers() -> None:
    (entry,) = json.loads(*of("ENTRYPOINT"))
    arguments = json.loads(*of("CMD"))
    assert entry in PROJECT["scripts"]
    assert arguments[0] == "run"
    assert f"deploy/springscale.toml {arguments[2]}" in of("COPY")
    (probe,) = of("HEALTHCHECK")
    port, path = re.findall(r"127\.0\.0\.1:(\d+)(/[a-z/]+)", probe)[0]
    assert [port] == of("EXPOSE")
    assert path in PUBLIC_PATHS


@pytest.mark.parametrize("stage", of("FROM"))
def test_the_image_has_the_python_that_the_locks_are_for(stage: str) -> None:
    found = re.match(r"python:(3\.\d+)-slim", stage)
    assert found is not None
    assert found[1] == re.search(r"Python (3\.\d+)", (ROOT / "requirements.txt").read_text())[1]  # type: ignore[index]
