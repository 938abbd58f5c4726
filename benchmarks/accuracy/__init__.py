"""How well the estimators weigh: studies that take minutes, on simulated vans and on a campaign's own runs.

Campaign files and seeds come in; numbers (NAME.json) and the page made of them (NAME.md) go out, which docs/ shows.
Run by ``python -m benchmarks.accuracy coverage|advice|learning-curve|bounds``; nothing of it is in the wheel.
"""
