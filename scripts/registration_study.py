"""How good the robust registration is, and whether its intervals tell the truth, on simulated tables.

Usage: ``python scripts/registration_study.py [--tables 1000] [--fits 2000] [--only accuracy|coverage]``

Accuracy: a box of 1600 x 800 x 1200 mm with 60 spots and 0.3 mm noise per coordinate. Of the bad spots half carry each
other's names and half are 5 to 40 mm off. Beside ours stand least squares that knows which rows are bad and leaves them
out, and least squares that also knows the true names. Printed is the median over the tables of the largest error of the
transform over all spots, mm.

Coverage: how often the true transform lies within the 95 % interval of each of its six parameters, for 8, 14 and 100
spots, clean and with 15 to 30 % bad ones; the mean over the parameters, and the worst of them.

The simulator and the oracles share no code with the package.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from respot.calibration.uncertainty import transform_uncertainty
from respot.registration.exchanged import ExchangeResult, find_exchanged

Array = NDArray[np.float64]
BOX = np.array([1600.0, 800.0, 1200.0])
NOISE = 0.3


class Table:
    """A made-up table: what is known to the fit, and what is true."""

    def __init__(self, dice: np.random.Generator, n: int, bad: int) -> None:
        self.source = dice.uniform(-0.5, 0.5, (n, 3)) * BOX + [4000.0, 0.0, 1000.0]
        self.rotation = _turn(dice.normal(size=3) * 0.02)
        self.translation = dice.normal(size=3) * 20.0
        self.true = self.source @ self.rotation.T + self.translation
        clean = self.true + dice.normal(size=(n, 3)) * NOISE
        rows = dice.permutation(n)[:bad]
        swapped = rows[: 2 * (bad // 4)] if bad > 3 else rows[:0] if bad < 2 else rows[:2]
        self.shifted = rows[len(swapped) :]
        self.names = np.arange(n)
        self.names[swapped] = swapped.reshape(-1, 2)[:, ::-1].ravel() if len(swapped) else swapped
        self.named_right = clean.copy()
        way = dice.normal(size=(len(self.shifted), 3))
        way *= (dice.uniform(5.0, 40.0, len(self.shifted)) / np.linalg.norm(way, axis=1))[:, None]
        self.named_right[self.shifted] += way
        self.reference = self.named_right[self.names]
        self.bad = np.zeros(n, dtype=bool)
        self.bad[rows] = True


def _turn(vector: Array) -> Array:
    """Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    result: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return result


def _kabsch(source: Array, reference: Array) -> tuple[Array, Array]:
    first, second = source.mean(axis=0), reference.mean(axis=0)
    u, _, v = np.linalg.svd((source - first).T @ (reference - second))
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(v.T @ u.T)))])
    rotation = v.T @ flip @ u.T
    return rotation, second - rotation @ first


def _largest(table: Table, rotation: Array, translation: Array) -> float:
    return float(np.linalg.norm(table.source @ rotation.T + translation - table.true, axis=1).max())


def _fit(table: Table, seed: int) -> ExchangeResult:
    return find_exchanged([f"S{n}" for n in range(len(table.source))], table.source, table.reference, seed=seed)


def accuracy(tables: int) -> None:
    """Print the table of errors."""
    print(f"largest error of the transform over 60 spots, median of {tables} tables, mm")
    print(f"{'bad':>5}{'ours':>9}{'knows bad':>11}{'knows names':>13}{'ratio':>9}{'ratio':>9}")
    for share in (0.0, 0.1, 0.3, 0.5):
        errors = np.array(list(_errors(tables, share)))
        ours, rows, names = np.median(errors, axis=0)
        print(f"{share:5.0%}{ours:9.4f}{rows:11.4f}{names:13.4f}{ours / rows:9.3f}{ours / names:9.3f}", flush=True)


def _errors(tables: int, share: float) -> Iterator[tuple[float, float, float]]:
    for number in range(tables):
        table = Table(np.random.default_rng((number, int(share * 100))), 60, round(60 * share))
        rigid = _fit(table, number).robust.rigid
        good = ~table.bad
        knows_bad = _kabsch(table.source[good], table.reference[good])
        right = np.ones(60, dtype=bool)
        right[table.shifted] = False
        knows_names = _kabsch(table.source[right], table.named_right[right])
        yield (
            _largest(table, rigid.rotation, rigid.translation),
            _largest(table, *knows_bad),
            _largest(table, *knows_names),
        )


def coverage(fits: int) -> None:
    """Print how often intervals hold the truth."""
    print(f"share of {fits} fits whose 95 % interval holds the true value: mean of six parameters, lowest, highest")
    for n in (8, 14, 100):
        for least, most in ((0.0, 0.0), (0.15, 0.30)):
            held = np.array(
                [_held(np.random.default_rng((number, n, int(most * 100))), n, least, most) for number in range(fits)]
            )
            share = held.mean(axis=0)
            what = "clean" if most == 0.0 else f"{least:.0%} to {most:.0%} bad"
            print(f"{n:5} spots, {what:15}{share.mean():8.3f}{share.min():8.3f}{share.max():8.3f}", flush=True)


def _held(dice: np.random.Generator, n: int, least: float, most: float) -> NDArray[np.bool_]:
    bad = int(dice.integers(int(np.ceil(n * least)), int(n * most) + 1)) if most else 0
    table = Table(dice, n, bad)
    found = _fit(table, 0).robust
    inliers = found.inliers
    points = table.source @ found.rigid.rotation.T + found.rigid.translation
    known = transform_uncertainty(points[inliers], found.rigid.residuals[inliers])
    turn = table.rotation @ found.rigid.rotation.T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    centre = found.rigid.rotation.T @ (known.centroid - found.rigid.translation)
    shift = table.rotation @ centre + table.translation - known.centroid
    error = np.concatenate([shift, np.degrees(vector)])
    result: NDArray[np.bool_] = np.abs(error) <= known.half_width
    return result


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--tables", type=int, default=1000)
    parser.add_argument("--fits", type=int, default=2000)
    parser.add_argument("--only", choices=("accuracy", "coverage"))
    options = parser.parse_args()
    if options.only != "coverage":
        accuracy(options.tables)
    if options.only != "accuracy":
        coverage(options.fits)


if __name__ == "__main__":
    main()
