"""Tridiagonal systems of equations. scipy.linalg solves them too, but costs a service 29 MB."""

import numpy as np

from gateway.records import F64


def solve_tridiagonal(below: F64, diagonal: F64, above: F64, right: F64) -> F64:
    """x (n,) with below[i] x[i-1] + diagonal[i] x[i] + above[i] x[i+1] = right[i]; below[0] and above[-1] must be 0.

    Each row must be dominated by its diagonal. By cyclic reduction: the unknowns with an even index are eliminated at
    once, until one unknown is left (R. W. Hockney, J. ACM 12 (1965) 95-113). Raises ValueError if a number is not
    finite.
    """
    n = len(diagonal)
    rows = np.zeros((4, (1 << n.bit_length()) - 1))  # of below, diagonal, above, right; the added unknowns are 0
    rows[1, n:] = 1.0
    rows[:, :n] = below, diagonal, above, right
    if not np.isfinite(rows).all():
        raise ValueError("the equations contain infs or NaNs")
    eliminated = []
    while rows.shape[1] > 1:
        kept, gone = rows[:, 1::2], rows[:, ::2]
        eliminated.append(gone)
        before, after = gone[:, :-1], gone[:, 1:]
        by_before, by_after = kept[0] / before[1], kept[2] / after[1]
        rows = np.stack(
            [
                -by_before * before[0],
                kept[1] - by_before * before[2] - by_after * after[0],
                -by_after * after[2],
                kept[3] - by_before * before[3] - by_after * after[3],
            ]
        )
    x: F64 = rows[3] / rows[1]
    for gone in reversed(eliminated):
        around = np.concatenate([[0.0], x, [0.0]])
        found = np.empty(2 * len(x) + 1)
        found[1::2] = x
        found[::2] = (gone[3] - gone[0] * around[:-1] - gone[2] * around[1:]) / gone[1]
        x = found
    return x[:n]
