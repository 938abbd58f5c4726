"""The output of commands that the pages quote, run on simulated drives."""

import contextlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from click.testing import CliRunner

from gateway.cli import springscale
from gateway.offline.bundle import CONTRIBUTION, TEMPLATE
from gateway.workbench.simulate import bench_of, write_campaign


def campaign_pack() -> str:
    """`springscale campaign pack` (docs/contribute.md): ten runs of a minute with the page's own contribution.toml."""
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_campaign(bench_of("experiment", longest_s=60.0), Path.cwd())
        Path(CONTRIBUTION).write_text(TEMPLATE, encoding="utf-8")
        return _output("campaign", "pack", ".", "--output", "my-van.zip")


def _output(*command: str) -> str:
    """The command's output as a Markdown code block."""
    result = CliRunner().invoke(springscale, list(command), catch_exceptions=False)
    if result.exit_code:
        sys.exit(result.output)
    return f"```text\n{result.stdout}```\n"
