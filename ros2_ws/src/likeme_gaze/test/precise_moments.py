"""The textbook moments evaluated with 80 decimal digits."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = list[Decimal]
Matrix = list[Vector]
DIGITS = 80


class Precise(NamedTuple):
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    input_output_covariance: NDArray[np.float64]


def exact(values: Sequence[float]) -> Vector:
    return [Decimal(float(value)) for value in values]


def eliminated(matrix: Matrix, right: Matrix) -> tuple[Matrix, Decimal]:
    """A⁻¹B and |A| by elimination with pivots."""
    rows = [[*a, *b] for a, b in zip(matrix, right, strict=True)]
    n, determinant = len(rows), Decimal(1)
    for column in range(n):
        pivot = max(range(column, n), key=lambda r: abs(rows[r][column]))
        if pivot != column:
            rows[column], rows[pivot] = rows[pivot], rows[column]
            determinant = -determinant
        determinant *= rows[column][column]
        top = [value / rows[column][column] for value in rows[column]]
        rows[column] = top
        for r in range(n):
            if r != column and rows[r][column]:
                by = rows[r][column]
                rows[r] = [value - by * t for value, t in zip(rows[r], top, strict=True)]
    return [row[n:] for row in rows], determinant


def product(a: Matrix, b: Matrix) -> Matrix:
    return [[dot(row, column) for column in zip(*b, strict=True)] for row in a]


def dot(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    return sum((x * y for x, y in zip(a, b, strict=True)), Decimal(0))


def identity(n: int) -> Matrix:
    return [[Decimal(int(i == j)) for j in range(n)] for i in range(n)]


class PreciseGP:
    """One output after another, formula for formula as in Deisenroth et al. 2009."""

    def __init__(
        self,
        inputs: NDArray[np.float64],
        targets: NDArray[np.float64],
        log_lengthscales: NDArray[np.float64],
        log_signal_std: NDArray[np.float64],
        log_noise_std: NDArray[np.float64],
    ) -> None:
        with localcontext() as context:
            context.prec = DIGITS
            self.inputs = [exact(row) for row in inputs]
            self.squares = [[(2 * v).exp() for v in exact(row)] for row in log_lengthscales]
            self.signal = [(2 * v).exp() for v in exact(log_signal_std)]
            self.noise = [(2 * v).exp() for v in exact(log_noise_std)]
            self.precision = [self._precision(a) for a in range(len(self.signal))]
            self.weights = [
                [dot(row, exact(targets[:, a])) for row in self.precision[a]]
                for a in range(len(self.signal))
            ]

    def propagate(self, mean: NDArray[np.float64], covariance: NDArray[np.float64]) -> Precise:
        with localcontext() as context:
            context.prec = DIGITS
            at, spread = exact(mean), [exact(row) for row in covariance]
            away = [[x - m for x, m in zip(row, at, strict=True)] for row in self.inputs]
            firsts = [self._first(a, spread, away) for a in range(len(self.signal))]
            means = [first[0] for first in firsts]
            outputs = range(len(means))
            second = [[self._second(a, b, spread, away, means) for b in outputs] for a in outputs]
            crossed = [[float(first[1][d]) for first in firsts] for d in range(len(at))]
        return Precise(
            np.array([float(m) for m in means]),
            np.array([[float(v) for v in row] for row in second]),
            np.array(crossed),
        )

    def _precision(self, a: int) -> Matrix:
        kernel = [
            [self._kernel(a, [x - y for x, y in zip(p, q, strict=True)]) for q in self.inputs]
            for p in self.inputs
        ]
        for i, row in enumerate(kernel):
            row[i] += self.noise[a]
        return eliminated(kernel, identity(len(kernel)))[0]

    def _kernel(self, a: int, away: Vector) -> Decimal:
        scaled = sum((v * v / s for v, s in zip(away, self.squares[a], strict=True)), Decimal(0))
        return self.signal[a] * (-scaled / 2).exp()

    def _first(self, a: int, spread: Matrix, away: list[Vector]) -> tuple[Decimal, Vector]:
        """Mean, and S(S + Λ)⁻¹ Σ β q (x_i - m)."""
        wide = [list(row) for row in spread]
        for d, square in enumerate(self.squares[a]):
            wide[d][d] += square
        inverse, determinant = eliminated(wide, identity(len(wide)))
        for square in self.squares[a]:
            determinant /= square
        weighted = [
            w * self.signal[a] * (-dot(u, [dot(row, u) for row in inverse]) / 2).exp()
            for w, u in zip(self.weights[a], away, strict=True)
        ]
        weighted = [value / determinant.sqrt() for value in weighted]
        pulled = [dot(weighted, [u[d] for u in away]) for d in range(len(wide))]
        inner = [dot(row, pulled) for row in inverse]
        return sum(weighted, Decimal(0)), [dot(row, inner) for row in spread]

    def _second(
        self, a: int, b: int, spread: Matrix, away: list[Vector], means: Vector
    ) -> Decimal:
        """β'Qβ - m m, and for a = b also σ_f² - tr(K⁻¹Q) + σ_n²."""
        narrow = [1 / s + 1 / t for s, t in zip(self.squares[a], self.squares[b], strict=True)]
        wide = [[s * v for s, v in zip(row, narrow, strict=True)] for row in spread]
        for d in range(len(wide)):
            wide[d][d] += 1
        middle, determinant = eliminated(wide, spread)
        scale = determinant.sqrt()
        left = [[v / s for v, s in zip(u, self.squares[a], strict=True)] for u in away]
        right = [[v / s for v, s in zip(u, self.squares[b], strict=True)] for u in away]
        total, trace = Decimal(0), Decimal(0)
        for i, p in enumerate(left):
            for j, q in enumerate(right):
                z = [x + y for x, y in zip(p, q, strict=True)]
                entry = self._kernel(a, away[i]) * self._kernel(b, away[j])
                entry *= (dot(z, [dot(row, z) for row in middle]) / 2).exp() / scale
                total += self.weights[a][i] * self.weights[b][j] * entry
                if a == b:
                    trace += self.precision[a][i][j] * entry
        total -= means[a] * means[b]
        return total + self.signal[a] - trace + self.noise[a] if a == b else total
