"""The rooms of gateway, drawn from the code's own imports and from the layers that import-linter enforces."""

import textwrap
import tomllib
from pathlib import Path
from typing import Final

import grimp

from drawings.canvas import Canvas, Point

PYPROJECT: Final = Path(__file__).parents[2] / "pyproject.toml"
PACKAGE: Final = "gateway"
MODULES: Final = ("setup", "config")  # single files that are drawn like rooms; others are small and shared
SHARED: Final = frozenset({"estimate_json", "files", "stated"})  # folders that are small and shared like those
WIDTH: Final = 840
MIDDLES: Final = {
    **{
        "cli": 420.0,
        "service": 220.0,
        "reports": 430.0,
        "fleet": 660.0,
        "archive": 390.0,
        "offline": 570.0,
        "workbench": 750.0,
    },
    **{"uplink": 120.0, "web": 300.0, "calibration": 480.0, "bus": 680.0},
    "store": 120.0,
    **{"setup": 390.0, "config": 240.0, "core": 400.0, "sim": 750.0},
}
BOX: Final = (130.0, 42.0)
FIRST_Y: Final = 50.0
STEP_Y: Final = 88.0
N_LETTERS: Final = 20  # of small words, in one line of a box
LINE_LETTERS: Final = 130  # in one across the sheet


def _room_of(module: str) -> str:
    return module.removeprefix(f"{PACKAGE}.").partition(".")[0]


def _imports(graph: grimp.ImportGraph) -> dict[str, set[str]]:
    """What each room imports of the others."""
    children = graph.find_children(PACKAGE)
    rooms = {_room_of(child) for child in children if graph.find_children(child)} - SHARED | set(MODULES)
    unplaced = rooms ^ MIDDLES.keys()
    if unplaced:
        raise ValueError(f"docs/drawings/rooms.py has no place for, or too many of: {', '.join(sorted(unplaced))}")
    arrows: dict[str, set[str]] = {room: set() for room in rooms}
    for module in graph.modules:
        room = _room_of(module)
        if room in rooms:
            arrows[room] |= {_room_of(other) for other in graph.find_modules_directly_imported_by(module)}
    return {room: (others & rooms) - {room} for room, others in arrows.items()}


def _reached(room: str, arrows: dict[str, set[str]]) -> set[str]:
    """All rooms that can be come to along the arrows."""
    return arrows[room].union(*(_reached(other, arrows) for other in arrows[room]))


def _without_detours(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """Only those arrows that no chain of others stands for."""
    implied = {room: {far for near in others for far in _reached(near, arrows)} for room, others in arrows.items()}
    return {room: others - implied[room] for room, others in arrows.items()}


def _layers() -> list[list[str]]:
    """The layers of the first import contract, uppermost first."""
    contracts = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    return [[_room_of(one.strip()) for one in layer.split("|")] for layer in contracts[0]["layers"]]


def _parts(graph: grimp.ImportGraph, room: str) -> list[str]:
    """The rooms inside it, in lines that fit its box."""
    inside = sorted(child for child in graph.find_children(f"{PACKAGE}.{room}") if graph.find_children(child))
    lines = [""]
    for name in (child.rpartition(".")[2] for child in inside):
        longer = f"{lines[-1]}, {name}".removeprefix(", ")
        lines = [*lines[:-1], longer] if len(longer) <= N_LETTERS else [*lines, name]
    return [line for line in lines if line]


def rooms() -> str:
    """The drawing as SVG."""
    graph = grimp.build_graph(PACKAGE, cache_dir=None)
    layers = _layers()
    rows = [placed for layer in layers if (placed := [room for room in layer if room in MIDDLES])]
    shared = ", ".join(room for layer in layers for room in layer if room not in MIDDLES)
    parts = {room: _parts(graph, room) for row in rows for room in row}
    heights = {room: BOX[1] + 14.0 * len(lines) for room, lines in parts.items()}
    tops: dict[str, float] = {}
    y = FIRST_Y
    for row in rows:
        tops |= dict.fromkeys(row, y)
        y += STEP_Y + max(heights[room] for room in row) - BOX[1]
    sheet = Canvas(WIDTH, round(y) + 60, "The rooms of gateway and which of them import which")
    sheet.text(20, 28, "An arrow means “imports”. Where a chain of arrows says it already, none is drawn.", ink="soft",
               style="small", anchor="start")  # fmt: skip
    for room, others in sorted(_without_detours(_imports(graph)).items()):
        for other in sorted(others):
            begin: Point = (MIDDLES[room], tops[room] + heights[room])
            sheet.arrow([begin, *_bends(room, other, tops), (MIDDLES[other], tops[other])], "blue")
    for room, top in tops.items():
        sheet.box(MIDDLES[room] - BOX[0] / 2, top, BOX[0], heights[room])
        sheet.text(MIDDLES[room], top + 26, room, style="bold")
        sheet.lines_of_text(MIDDLES[room], top + 42, parts[room])
    sheet.box(20, y, WIDTH - 40, BOX[1])
    sheet.lines_of_text(WIDTH / 2, y + 18, textwrap.wrap(f"small modules that rooms share: {shared}", LINE_LETTERS))
    return sheet.svg()


def _bends(room: str, other: str, tops: dict[str, float]) -> list[Point]:
    """Where an arrow that passes a row has to step aside: straight down first, across just above its end."""
    passed = [one for one in tops if tops[room] < tops[one] < tops[other]]
    if not passed:
        return []
    across = tops[other] - 22.0
    return [(MIDDLES[room], across)] if MIDDLES[room] != MIDDLES[other] else []
