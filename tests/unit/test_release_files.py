"""What a release, deploy/ and the locks say agrees with the program, and a Debian package holds its own code only."""

import json
import re
import shlex
import shutil
import sys
import tomllib
from dataclasses import fields
from fnmatch import fnmatch
from importlib.metadata import version
from pathlib import Path

import make_deb
import pytest
import yaml
from machine_code import ELF_MAGIC, PROCESSORS, ForeignCodeError, require_own_code, wheel_options
from make_deb import UNIMPORTED, of_desk
from packaging.tags import Tag
from packaging.utils import parse_wheel_filename
from support.commands import ended
from support.locks import ROOT, pins

from gateway.config import load_settings
from gateway.core.weights.limits import Limits
from gateway.web.routes.monitoring import alive_router

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
IMAGE = (ROOT / "deploy/container/Containerfile").read_text()
INSTRUCTIONS = re.findall(r"^([A-Z]+) ((?:.*\\\n)*.*)$", IMAGE, re.MULTILINE)


def of(instruction: str) -> list[str]:
    """The text after each occurrence in the image's definition, on one line."""
    return [re.sub(r"\\\n\s*", "", rest) for name, rest in INSTRUCTIONS if name == instruction]


def test_there_is_one_version() -> None:
    said = ended(sys.executable, "-m", "gateway", "--version").stdout
    assert said.split()[-1] == PROJECT["version"] == version("springscale") == make_deb.version()
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == PROJECT["version"]


def test_the_citation_is_valid() -> None:
    command = ("check_jsonschema", "--builtin-schema", "vendor.citation-file-format", ROOT / "CITATION.cff")
    checked = ended(sys.executable, "-m", *command, check=False)
    assert checked.returncode == 0, checked.stdout


def test_the_image_copies_existing_files_that_are_not_ignored() -> None:
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


def test_the_image_runs_the_service_as_an_unprivileged_user() -> None:
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
    assert path in {route.path for route in alive_router().routes}


@pytest.mark.parametrize("stage", of("FROM"))
def test_the_image_has_the_python_that_the_locks_are_for(stage: str) -> None:
    found = re.match(r"python:(3\.\d+)-slim", stage)
    assert found[1] == re.search(r"Python (3\.\d+)", (ROOT / "requirements.txt").read_text())[1]  # type: ignore[index]


DEPLOY = Path(__file__).parents[2] / "deploy"
UNIT = (DEPLOY / "springscale.service").read_text()
COMMENTED_KEY = re.compile(r"^# (?=[a-z_]+ = )", re.MULTILINE)


def test_every_commented_key_of_the_shipped_configuration_is_a_setting(tmp_path: Path) -> None:
    text, n_keys = COMMENTED_KEY.subn("", (DEPLOY / "springscale.toml").read_text())
    assert n_keys > 10
    (tmp_path / "springscale.toml").write_text(text)
    settings = load_settings(tmp_path / "springscale.toml")
    assert settings.web.tls_key == tmp_path / "web.key"


def test_the_shipped_configuration_shows_the_true_defaults(tmp_path: Path) -> None:
    keys = ["calibration", "calibrated_as", "vin", "tls_certificate", "tls_key", "source_address", "url", "secret_file"]
    of_another_bus = ("interface", "channel")
    examples = [*keys, *of_another_bus, *(one.name for one in fields(Limits))]
    kept = [
        line
        for line in (DEPLOY / "springscale.toml").read_text().splitlines()
        if not line.startswith(tuple(f"# {key} =" for key in examples))
    ]
    (tmp_path / "springscale.toml").write_text("\n".join(kept))
    as_shipped = load_settings(tmp_path / "springscale.toml")
    (tmp_path / "springscale.toml").write_text(COMMENTED_KEY.sub("", "\n".join(kept)))
    assert load_settings(tmp_path / "springscale.toml") == as_shipped


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not installed here")
def test_the_sandbox_scores_below_one_and_a_half_and_what_remains_is_explained() -> None:
    command = ("systemd-analyze", "security", "--no-pager", "--offline=true", DEPLOY / "springscale.service")
    report = ended(*command).stdout
    score = re.search(r"exposure level for springscale.service: ([\d.]+)", report)
    assert float(score[1]) <= 1.5
    explained = UNIT.partition("still counts, and why it stays:")[2]
    remaining = re.findall(r"^✗ (?:RootDirectory|\w+)", report, re.MULTILINE)
    assert remaining
    assert [name for name in remaining if name.removeprefix("✗ ") not in explained] == []


VEHICLE = pins("requirements.txt")
FOR_DESKS = ("matplotlib", "numba", "llvmlite", "pillow")


def test_the_workbench_has_all_of_a_vehicle_and_the_extra_at_the_same_versions() -> None:
    desk = pins("requirements-workbench.txt")
    assert desk.items() > VEHICLE.items()
    extra = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["workbench"]
    assert {requirement.partition(">=")[0] for requirement in extra} <= desk.keys() - VEHICLE.keys()


@pytest.mark.parametrize("name", ["requirements-build.txt", "requirements-dev.txt"])
def test_no_lock_contradicts_another(name: str) -> None:
    others = {**pins("requirements-workbench.txt"), **pins("requirements-build.txt")}
    both = pins(name).items() & others.items()
    assert {package for package, _ in both} == pins(name).keys() & others.keys()


def test_the_debian_packages_part_along_the_locks() -> None:
    assert set(FOR_DESKS) <= of_desk()
    assert not of_desk() & VEHICLE.keys()
    assert VEHICLE.keys() >= UNIMPORTED


def elf(architecture: str) -> bytes:
    """The head of an ELF file."""
    return ELF_MAGIC.ljust(18, b"\0") + PROCESSORS[architecture].elf_machine.to_bytes(2, "little") + bytes(44)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy/core.so").write_bytes(elf("arm64"))
    (tmp_path / "numpy/core.py").write_text("pure")
    (tmp_path / "numpy/dangling.so").symlink_to("nowhere")
    (tmp_path / "empty").write_bytes(b"")
    return tmp_path


def test_foreign_machine_code_is_named(tree: Path) -> None:
    (tree / "stray.so").write_bytes(elf("amd64"))
    with pytest.raises(ForeignCodeError, match=r"^not machine code for arm64: stray\.so$"):
        require_own_code(tree, "arm64")


def test_a_tree_without_machine_code_is_no_package_of_ours(tmp_path: Path) -> None:
    with pytest.raises(ForeignCodeError, match="no machine code"):
        require_own_code(tmp_path, "amd64")


@pytest.mark.parametrize("processor", ["x86_64", "aarch64"])
def test_wheels_are_chosen_for_the_processor_and_debian_12(processor: str) -> None:
    options = wheel_options("arm64")
    platforms = {option.removeprefix("--platform=") for option in options if option.startswith("--platform=")}
    wheel = f"numpy-2.4.6-cp311-cp311-manylinux_2_27_{processor}.manylinux_2_28_{processor}.whl"
    tags: frozenset[Tag] = parse_wheel_filename(wheel)[3]
    assert bool({tag.platform for tag in tags} & platforms) == (processor == "aarch64")
    assert not any("2_39" in platform for platform in platforms)
