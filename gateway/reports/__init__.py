"""Pages and figures for the desk: HTML that is whole in its directory, SVG, and the numbers beside them as JSON.

``charts`` describes charts and draws them still or live, ``calibration`` reports a calibration or an evaluation,
``paper`` drives the paper's section 4 again. Reports lean on the rooms below and nothing leans on them;
matplotlib and plotly are known here alone, and loaded when a report is asked for.
"""
