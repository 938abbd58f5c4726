"""Reports: self-contained HTML pages with SVG charts, and the same numbers as JSON.

``charts`` describes charts and draws them, ``calibration`` reports a calibration or an
evaluation, ``paper`` repeats the drives of the paper's section 4. Only this package imports matplotlib, and
only when a report is requested.
"""
