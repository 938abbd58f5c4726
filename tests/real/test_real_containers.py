"""The container files, by the tools that read them, where these are here: the compose stack, and a build."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from support.parts import found
from support.patience import wait_until

ROOT = Path(__file__).parents[2]
COMPOSE = ROOT / "deploy/fleet/compose.yaml"
CONTAINERFILE = ROOT / "deploy/container/Containerfile"
BUILD_S = 1800
TAG = "springscale-test"


def engine() -> str | None:
    """podman, or a docker whose daemon answers."""
    for name in ("podman", "docker"):
        program = found(name)
        if program and subprocess.run([program, "info"], capture_output=True, timeout=60, check=False).returncode == 0:
            return program
    return None


def test_a_compose_tool_reads_the_stack(tmp_path: Path) -> None:
    program = found("podman-compose") or found("docker-compose")
    if program is None:
        pytest.skip("neither podman-compose nor docker-compose is on the path")
    if "podman" in program and found("podman") is None:
        pytest.skip("podman-compose asks podman for its version, and podman is not here")
    names = [
        line.partition("=")[0] for line in (ROOT / "deploy/fleet/.env.example").read_text().splitlines() if "=" in line
    ]
    (tmp_path / ".env").write_text("".join(f"{name}=chosen\n" for name in names if not name.startswith("#")))
    command = [program, "--env-file", str(tmp_path / ".env"), "-f", str(COMPOSE), "config"]
    beside = os.pathsep.join([str(Path(found("podman") or program).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": beside}
    read = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert read.returncode == 0, read.stdout + read.stderr
    for service in ("mosquitto", "database", "subscriber"):
        assert service in read.stdout


def test_the_image_is_built_runs_unprivileged_and_keeps_its_health_check() -> None:
    """OCI images keep no HEALTHCHECK: podman wants --format docker for it."""
    if not os.environ.get("SPRINGSCALE_CONTAINERS"):
        pytest.skip("an image takes minutes, and not every engine can run one: SPRINGSCALE_CONTAINERS=1 asks for it")
    program = engine()
    if program is None:
        pytest.skip("no container engine answers: neither podman nor a docker daemon")
    more = ["--format", "docker"] if Path(program).name == "podman" else []
    command = [program, "build", *more, "--file", str(CONTAINERFILE), "--tag", TAG, str(ROOT)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_S, check=False)
    assert built.returncode == 0, built.stderr[-3000:]
    seen = json.loads(_said(program, "inspect", TAG))[0]
    check = seen["Config"].get("Healthcheck") or seen["Healthcheck"]  # docker's place, and podman's
    assert check["Test"][0] == "CMD"
    assert "health/live" in check["Test"][-1]
    assert "springscale" in _said(program, "run", "--rm", TAG, "--version")
    as_told = ("--read-only", "--cap-drop", "all", "--tmpfs", "/var/lib/springscale:mode=1777")
    name = _said(program, "run", "--rm", "--detach", *as_told, TAG).strip()
    try:
        assert wait_until(lambda: _is_well(program, name, check["Test"][1:])), _said(program, "logs", name)
        assert "uid=880" in _said(program, "exec", name, "id")
    finally:
        _said(program, "stop", name)


def _said(program: str, *arguments: str) -> str:
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=True).stdout


def _is_well(program: str, name: str, check: list[str]) -> bool:
    """The image's own check, inside: without systemd podman runs none by itself."""
    return subprocess.run([program, "exec", name, *check], capture_output=True, check=False).returncode == 0
