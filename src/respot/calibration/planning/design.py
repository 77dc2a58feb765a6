"""Choice of spots by what they add: greedy steps, then exchanges.

What is wanted of spots are answers to questions, each about a linear model with some parameters that are known to a
covariance. A *discrimination* asks how badly the model imitates a field that is taken for true: the least squares that
it leaves, in units of the noise (T-optimality: Atkinson and Fedorov, Biometrika 62 (1975), 57). An *estimation* asks
how well its parameters are known (D-optimality: the determinant of their information). A spot changes the answers by
3 x 3 matrices alone, so all candidates are judged at once. The exchange is Fedorov's (Theory of Optimal Experiments,
1972): each chosen spot is replaced by whichever is best beside the others, until none is better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]

_ENOUGH = 30.0
"""Squares beyond this buy nothing: two explanations are apart by more than five standard deviations."""
_OF_ESTIMATION = 0.1
"""What the logarithm of the determinant counts beside discriminations: it decides where they do not."""
_PASSES = 3
_MOST_EXCHANGED = 60
_BETTER = 1e-9


@dataclass(eq=False)
class Question:
    """A linear model over n candidates, its covariance the unit matrix before any of them is measured.

    Attributes
    ----------
    rows : (n, 3, q) array
        Columns at the candidates, in units of the noise, turned so that the parameters are independent.
    error : (n, 3) array
        What the model does not imitate there, in units of the noise; zero of an estimation.
    found : float
        Squares that it does not imitate at the spots that were measured.
    estimation : bool
        Ask for the parameters, not for the error.
    """

    rows: Array
    error: Array
    found: float = 0.0
    estimation: bool = False
    covariance: Array = field(init=False)
    spread: Array = field(init=False)

    def __post_init__(self) -> None:
        self.error = self.error.copy()
        self.covariance = np.eye(self.rows.shape[2])
        self.spread = np.einsum("nik,njk->nij", self.rows, self.rows, optimize=True)

    def change(self, row: int, sign: float) -> None:
        """Take a candidate among the measured spots (1), or out of them again (-1)."""
        seen = self.covariance @ self.rows[row].T
        step = np.linalg.inv(np.eye(3) + sign * (self.rows[row] @ seen))
        step = (step + step.T) / 2.0
        own = self.error[row].copy()
        beside = self.rows @ seen
        self.found += sign * float(own @ step @ own)
        self.error -= sign * (beside @ (step @ own))
        self.spread -= sign * ((beside @ step) @ np.swapaxes(beside, 1, 2))
        self.covariance -= sign * (seen @ step @ seen.T)

    def with_all(self) -> float:
        """Squares that it does not imitate when every candidate is measured."""
        design = self.rows.reshape(-1, self.rows.shape[2])
        error = self.error.ravel()
        pull = design.T @ error
        left = np.linalg.inv(self.covariance) + design.T @ design
        return self.found + float(error @ error - pull @ np.linalg.solve(left, pull))


def whitened(normal: Array, rows: Array) -> tuple[Array, Array]:
    """Rows (n, 3, q) of parameters with a normal matrix (q, q), turned so that their covariance is the unit matrix.

    Returns
    -------
    ((n, 3, q) array, (q, q) array)
        The turned rows; the matrix that turns: parameters are it times independent ones.
    """
    scale = 1.0 / np.sqrt(np.diag(normal))
    lower = np.linalg.cholesky(normal * np.outer(scale, scale))
    # columns of like size before anything is solved: priors of metres stand beside those of millidegrees
    turn = linalg.solve_triangular(lower, np.diag(scale), lower=True).T
    return np.asarray(rows @ turn), np.asarray(turn)


class Design:
    """Questions and the candidates that are chosen to answer them.

    Parameters
    ----------
    questions : sequence of Question
        About the same n candidates.
    known : sequence of float
        Squares that are on hand for each of them already.
    """

    def __init__(self, questions: Sequence[Question], known: Sequence[float]) -> None:
        self.questions = list(questions)
        self._at_first = np.array([question.found for question in questions])
        self._known = np.array(known, dtype=np.float64)
        self._asked = np.array([not question.estimation for question in questions], dtype=np.bool_)
        self.chosen: list[int] = []

    @property
    def squares(self) -> Array:
        """Squares (questions,) that are expected once the chosen spots are measured, those on hand among them."""
        return np.asarray(self._known + np.array([question.found for question in self.questions]) - self._at_first)

    def worth(self) -> Array:
        """What each candidate (n,) adds to the objective beside the chosen ones; minus infinity for these."""
        spread = np.stack([question.spread for question in self.questions])
        error = np.stack([question.error for question in self.questions])
        gains, determinants = _quadratic(spread, error)
        now = self.squares[self._asked, None]
        after = np.minimum(now + gains[self._asked], _ENOUGH)
        worth: Array = np.sum(np.log1p(after) - np.log1p(np.minimum(now, _ENOUGH)), axis=0)
        worth = worth + _OF_ESTIMATION * determinants[~self._asked].sum(axis=0)
        worth[self.chosen] = -np.inf
        return worth

    def _take(self, row: int) -> None:
        for question in self.questions:
            question.change(row, 1.0)
        self.chosen.append(row)

    def drop(self, row: int) -> None:
        """Take a chosen candidate back."""
        for question in self.questions:
            question.change(row, -1.0)
        self.chosen.remove(row)

    def choose(self, count: int) -> list[int]:
        """Choose so many candidates: one after the other by what each adds, then exchanged one by one.

        Returns
        -------
        list of int
            Sorted. More candidates need not hold all of fewer: exchanges may replace any of them.
        """
        while len(self.chosen) < count:
            self._take(_first_best(self.worth()))
        if count <= _MOST_EXCHANGED and count < self.questions[0].rows.shape[0]:
            for _ in range(_PASSES):
                if not self._exchange():
                    break
        return sorted(self.chosen)

    def _exchange(self) -> bool:
        changed = False
        for row in list(self.chosen):
            self.drop(row)
            worth = self.worth()
            best = _first_best(worth)
            if worth[best] > worth[row] + _BETTER:
                changed = True
            else:
                best = row
            self._take(best)
        return changed

    def in_order(self, rows: Sequence[int]) -> list[tuple[int, Array]]:
        """Take some candidates, each time the one that adds most, with the squares (questions,) after each."""
        found: list[tuple[int, Array]] = []
        left = list(rows)
        while left:
            row = left[_first_best(self.worth()[left])]
            self._take(row)
            left.remove(row)
            found.append((row, self.squares))
        return found


def _first_best(worth: Array) -> int:
    """The best one, of equal ones the first: rounding must not decide."""
    return int(np.argmax(worth >= worth.max() - _BETTER))


def _quadratic(spread: Array, error: Array) -> tuple[Array, Array]:
    """``e' (I + V)^-1 e`` and ``log det(I + V)`` of many 3 x 3 matrices V (..., 3, 3), by Cholesky written out."""
    a = np.sqrt(1.0 + spread[..., 0, 0])
    b, d = spread[..., 1, 0] / a, spread[..., 2, 0] / a
    c = np.sqrt(np.maximum(1.0 + spread[..., 1, 1] - b * b, 1e-300))
    e = (spread[..., 2, 1] - b * d) / c
    f = np.sqrt(np.maximum(1.0 + spread[..., 2, 2] - d * d - e * e, 1e-300))
    x = error[..., 0] / a
    y = (error[..., 1] - b * x) / c
    z = (error[..., 2] - d * x - e * y) / f
    return x * x + y * y + z * z, 2.0 * (np.log(a) + np.log(c) + np.log(f))
