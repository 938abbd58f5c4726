"""The notebook runs cell by cell as it stands; its table holds the load that was on board, and its plot shows it."""

import json
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples/weigh_from_arrays.ipynb"
TRUTHS_KG = [0.0, 0.0, 0.0, 270.0, 270.0]


@pytest.mark.filterwarnings("ignore:.*FigureCanvasAgg is non-interactive:UserWarning")  # plt.show() without a screen
def test_the_notebook_ends_in_a_table_and_a_plot_of_weights(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib").use("agg")
    names: dict[str, Any] = {}
    for number, cell in enumerate(json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{NOTEBOOK.name}, cell {number}", "exec"), names)
    assert capsys.readouterr().out.split()[:2] == ["t_end", "payload_kg"]
    weighed = names["weighed"]
    off = [
        abs(payload_kg - truth_kg) / std_kg
        for payload_kg, std_kg, truth_kg in zip(
            weighed["payload_kg"], weighed["payload_std_kg"], TRUTHS_KG, strict=True
        )
    ]
    assert max(off) < 2.0
    (drawn,) = names["figure"].axes
    assert drawn.get_ylabel() == "payload [kg]"
    assert list(drawn.get_lines()[0].get_ydata()) == list(weighed["payload_kg"])
