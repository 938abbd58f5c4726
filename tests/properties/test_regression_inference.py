"""The regressions of the ratio index without each run are those fitted to the other runs."""

import numpy as np

from gateway.calibration.ratio_index.least_squares import held_out_errors, without_each_run


def test_many_designs_at_once_are_each_fitted_as_if_alone() -> None:
    rng = np.random.default_rng(9)
    run = np.array([0, 0, 1, 1, 1, 2, 3, 3, 4, 4])
    columns = np.concatenate([np.ones((3, 10, 1)), rng.standard_normal((3, 10, 2))], axis=-1)
    target = rng.standard_normal(10)
    errors = held_out_errors(columns, without_each_run(columns, target, run)[0], target, run)
    for i in range(3):
        for number in range(5):
            out = run == number
            coefficients = np.linalg.lstsq(columns[i][~out], target[~out], rcond=None)[0]
            np.testing.assert_allclose(errors[i, out], columns[i][out] @ coefficients - target[out], atol=1e-8)
