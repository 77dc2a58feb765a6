"""How good the robust registration is, and whether its intervals tell the truth, on simulated tables.

Usage: ``python scripts/registration_study.py [--tables 1000] [--fits 2000] [--only NAME]``, one of accuracy, coverage,
alarms, directions, outliers

Accuracy: a box of 1600 x 800 x 1200 mm with 60 spots and 0.3 mm noise per coordinate. Of the bad spots half carry each
other's names and half are 5 to 40 mm off. Beside ours stand least squares that knows which rows are bad and leaves them
out, and least squares that also knows the true names. Printed is the median over the tables of the largest error of the
transform over all spots, mm.

Coverage: how often the true transform lies within the 95 % interval of each of its six parameters, for 8, 14 and 100
spots, clean and with 15 to 30 % bad ones; the mean over the parameters, and the worst of them. Two or three bad spots
are an exchanged pair (and one that is off) in every other table, and all off in the rest. Beside it, the same for least
squares that knows which rows are right, and in how many tables a good spot was left out or a bad one kept.

Alarms: how many tables without exchanged names are said to have some, and how many exchanged pairs are found, for spots
in the box and along a flange, noise that is the same along all axes and not, with and without spots that are off.

Directions: the fit that weighs each direction by its own noise, over plain least squares: the largest error of the
transform (medians), and the RMS error at ten spots that took no part; how often the 95 % intervals of the weighted fit
hold, those of plain least squares with the noise of each direction, and those with one noise for all; how often the
test calls the noise uneven.

Outliers: pairs judged by the length of their residual, and by the noise of its direction where the test calls the noise
uneven; the whole fit, with intervals by direction under the same condition. Printed: how often the 95 % intervals hold
(mean of six parameters, lowest), that of the shift along y by itself, the largest error of the transform over that of
least squares which knows the bad rows (medians), and in how many tables a good spot was left out, and a bad one kept.
Bad spots, a fifth where there are any, are 5 to 40 mm off.

The simulator and the oracles share no code with the package.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.uncertainty import (
    LEAST_FOR_DIRECTIONS,
    TransformUncertainty,
    transform_uncertainty,
    uncertainty_by_direction,
)
from respot.registration.anisotropy import fit_weighted, isotropy_p_value, plain_covariance
from respot.registration.covariance import unit_covariance
from respot.registration.exchanged import ExchangeResult, find_exchanged
from respot.registration.robust import RobustFit, fit_robust

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
        pairs = bad // 4 if bad > 3 else int(dice.integers(2)) if bad > 1 else 0
        swapped = rows[: 2 * pairs]
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
    print(f"share of {fits} fits whose 95 % interval holds the true value: mean of six parameters, lowest, highest;")
    print("the same for least squares over the right rows; share of tables that lost a good spot, and kept a bad one")
    for n in (8, 14, 100):
        for least, most in ((0.0, 0.0), (0.15, 0.30)):
            held, known, lost, kept = (
                np.array(column)
                for column in zip(
                    *(_held(np.random.default_rng((k, n, int(most * 100))), n, least, most) for k in range(fits)),
                    strict=True,
                )
            )
            ours, oracle = held.mean(axis=0), known.mean(axis=0)
            what = "clean" if most == 0.0 else f"{least:.0%} to {most:.0%} bad"
            print(
                f"{n:5} spots, {what:15}{ours.mean():8.3f}{ours.min():8.3f}{ours.max():8.3f}   "
                f"{oracle.mean():8.3f}{oracle.min():8.3f}   {lost.mean():8.4f}{kept.mean():8.4f}",
                flush=True,
            )


def _held(
    dice: np.random.Generator, n: int, least: float, most: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], bool, bool]:
    bad = int(dice.integers(int(np.ceil(n * least)), int(n * most) + 1)) if most else 0
    table = Table(dice, n, bad)
    found = _fit(table, 0)
    inliers = found.robust.inliers
    ours = _within(table, inliers, found.robust.rigid.rotation, found.robust.rigid.translation, found.permutation)
    right = ~table.bad
    oracle = _within(table, right, *_kabsch(table.source[right], table.reference[right]), np.arange(n))
    wrong = np.linalg.norm(table.reference[found.permutation] - table.true, axis=1) > 8.0 * NOISE
    return ours, oracle, bool((right & ~inliers).any()), bool((wrong & inliers).any())


def _within(
    table: Table, inliers: NDArray[np.bool_], rotation: Array, translation: Array, names: NDArray[np.intp]
) -> NDArray[np.bool_]:
    points = table.source @ rotation.T + translation
    left = (points - table.reference[names])[inliers]
    known = transform_uncertainty(points[inliers], left)
    if len(left) >= LEAST_FOR_DIRECTIONS:  # as a fit does it
        known = uncertainty_by_direction(known, points[inliers], left, 1.0)
    return _holds(known, rotation, translation, table.rotation, table.translation)


def _holds(
    known: TransformUncertainty, rotation: Array, translation: Array, true_rotation: Array, true_translation: Array
) -> NDArray[np.bool_]:
    """Which of the six intervals of a fit hold the true transform."""
    turn = true_rotation @ rotation.T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    centre = rotation.T @ (known.centroid - translation)
    shift = true_rotation @ centre + true_translation - known.centroid
    error = np.concatenate([shift, np.degrees(vector)])
    result: NDArray[np.bool_] = np.abs(error) <= known.half_width
    return result


def alarms(tables: int) -> None:
    """Print false alarms of exchanged names, and what is found of true ones."""
    print("names said to be exchanged in tables without any; and exchanged pairs found, with nothing else said")
    false = done = 0
    for n in (8, 14, 30, 60):
        for layout in ("box", "flange"):
            for noise in ((NOISE, NOISE, NOISE), (0.5, 5.0, 1.7)):
                for off in (0.0, 0.2):
                    count = max(1, tables // 32)
                    cases = [_alarm(np.random.default_rng((k, n)), n, layout, noise, off) for k in range(count)]
                    alarm, found = np.array(cases).sum(axis=0)
                    false, done = false + int(alarm), done + count
                    print(
                        f"{n:5} spots, {layout:7} noise {noise[0]:.1f}/{noise[1]:.1f}/{noise[2]:.1f}, {off:4.0%} off: "
                        f"{alarm:4} false, {found:4} of {count} found",
                        flush=True,
                    )
    print(f"false alarms: {false} of {done} tables")


def _alarm(dice: np.random.Generator, n: int, layout: str, noise: tuple[float, ...], off: float) -> tuple[bool, bool]:
    source = _spots(dice, n, layout)
    reference = source + dice.normal(size=(n, 3)) * noise
    rows = dice.permutation(n)
    for row in rows[: round(n * off)]:
        way = dice.normal(size=3)
        reference[row] += way * dice.uniform(5.0, 40.0) / np.linalg.norm(way)
    ids = [f"S{k}" for k in range(n)]
    alarm = bool(find_exchanged(ids, source, reference).cycles)
    pair = rows[-2:]
    reference[pair] = reference[pair[::-1]]
    cycles = find_exchanged(ids, source, reference).cycles
    return alarm, len(cycles) == 1 and set(cycles[0].rows) == set(pair.tolist())


def _spots(dice: np.random.Generator, n: int, layout: str) -> Array:
    if layout == "box":
        return dice.uniform(-0.5, 0.5, (n, 3)) * BOX
    rows = (n // 2, n - n // 2)  # two rows along a flange, spaced by hand
    along = np.concatenate([np.cumsum(dice.uniform(25, 70, row)) for row in rows])
    height = np.repeat([0.0, 310.0], rows) + dice.normal(size=n)
    return np.stack([-np.square(along) / 8000.0, along, height], axis=1)


def directions(tables: int) -> None:
    """Print what it brings to weigh each direction by its own noise."""
    print(f"weighted over plain least squares, {tables} tables each; coverage: mean of six parameters, lowest, highest")
    print(
        f"{'':34}{'error':>8}{'held out':>9}"
        f"{'weighted':>15}{'plain, by axis':>20}{'plain, one noise':>22}{'uneven':>10}"
    )
    for n in (8, 14, 60):
        for layout in ("box", "flange"):
            for noise in ((1.0, 1.0, 1.0), (0.5, 4.9, 1.7)):
                cases = [_direction(np.random.default_rng((k, n)), n, layout, noise) for k in range(tables)]
                errors, new, held, uneven = (np.array(column) for column in zip(*cases, strict=True))
                error, share = np.median(errors, axis=0), held.mean(axis=0)
                rms = np.sqrt(np.mean(new, axis=0))
                print(
                    f"{n:5} spots, {layout:7} {noise[0]:.1f}/{noise[1]:.1f}/{noise[2]:.1f} mm"
                    f"{error[0] / error[1]:10.3f}{rms[0] / rms[1]:9.3f}"
                    + "".join(f"{kind.mean():10.3f} {kind.min():.3f}-{kind.max():.3f}" for kind in share)
                    + f"{uneven.mean():8.3f}",
                    flush=True,
                )


def _direction(
    dice: np.random.Generator, n: int, layout: str, noise: tuple[float, ...]
) -> tuple[Array, Array, Array, bool]:
    spots = dice.permutation(_spots(dice, n + 10, layout))
    rotation = _turn(dice.normal(size=3) * 0.02)
    source, true, held_out = spots[:n], spots[:n] @ rotation.T, spots[n:] @ rotation.T
    reference = true + dice.normal(size=(n, 3)) * noise
    weighted, plain = fit_weighted(source, reference), _kabsch(source, reference)
    fits = ((weighted.rotation, weighted.translation), plain)
    errors = [float(np.linalg.norm(source @ r.T + t - true, axis=1).max()) for r, t in fits]
    new = [float(np.mean(np.sum((spots[n:] @ r.T + t - held_out) ** 2, axis=1))) for r, t in fits]
    points = source @ plain[0].T + plain[1]
    residuals = points - reference
    covariances = (
        (*fits[0], weighted.covariance, weighted.degrees_of_freedom),
        (*plain, plain_covariance(points, residuals.T @ residuals / (n - 2)), n - 2),
        (*plain, unit_covariance(points)[0] * np.sum(residuals**2) / (3 * n - 6), 3 * n - 6),
    )
    held = []
    for turned, shift, covariance, free in covariances:
        turn, centre = rotation @ turned.T, (source @ turned.T + shift).mean(axis=0)
        vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        error = np.concatenate([turn @ (centre - shift) - centre, vector])
        held.append(np.abs(error) <= stats.t.ppf(0.975, free) * np.sqrt(np.diag(covariance)))
    return np.array(errors), np.array(new), np.array(held), isotropy_p_value(source, reference) < 0.01


def outliers(tables: int) -> None:
    """Print what it brings to judge pairs by the noise of their direction."""
    print(
        f"pairs judged by length, and by direction; {tables} tables each: intervals (mean, lowest, along y), error over"
    )
    print("that of least squares that knows the bad rows, tables that lost a good spot and kept a bad one")
    for n in (8, 14, 60):
        for layout in ("box", "flange"):
            for noise in ((1.0, 1.0, 1.0), (0.5, 4.9, 1.7)):
                for bad in (0.0, 0.2):
                    cases = [_judged(np.random.default_rng((k, n)), n, layout, noise, bad) for k in range(tables)]
                    line = f"{n:5} spots, {layout:7} {noise[0]:.1f}/{noise[1]:.1f}/{noise[2]:.1f} mm {bad:4.0%} bad"
                    for way in zip(*cases, strict=True):
                        held, errors, lost, kept = (np.array(column) for column in zip(*way, strict=True))
                        share = held.mean(axis=0)
                        line += (
                            f"   {share.mean():.3f} {share.min():.3f} {share[1]:.3f} {np.median(errors):6.3f} "
                            f"{lost.mean():.3f} {kept.mean():.3f}"
                        )
                    print(line, flush=True)


_Verdict = tuple[NDArray[np.bool_], float, bool, bool]


def _judged(
    dice: np.random.Generator, n: int, layout: str, noise: tuple[float, ...], bad: float
) -> tuple[_Verdict, _Verdict]:
    source = dice.permutation(_spots(dice, n, layout))
    rotation = _turn(dice.normal(size=3) * 0.02)
    true = source @ rotation.T
    reference = true + dice.normal(size=(n, 3)) * noise
    wrong = np.arange(n) < round(bad * n)
    way = dice.normal(size=(int(wrong.sum()), 3))
    reference[wrong] += way * (dice.uniform(5.0, 40.0, len(way)) / np.linalg.norm(way, axis=1))[:, None]
    known, shift = _kabsch(source[~wrong], reference[~wrong])
    best = float(np.linalg.norm(source @ known.T + shift - true, axis=1).max())

    def verdict(fit: RobustFit) -> _Verdict:
        inliers, points = fit.inliers, fit.rigid.predict(source)
        sure = transform_uncertainty(points[inliers], fit.rigid.residuals[inliers])
        if inliers.sum() >= 8:
            alike = isotropy_p_value(source[inliers], reference[inliers])
            sure = uncertainty_by_direction(sure, points[inliers], fit.rigid.residuals[inliers], alike)
        held = _holds(sure, fit.rigid.rotation, fit.rigid.translation, rotation, np.zeros(3))
        error = float(np.linalg.norm(points - true, axis=1).max())
        return held, error / best, bool((~wrong & ~inliers).any()), bool((wrong & inliers).any())

    return (
        verdict(fit_robust(source, reference, by_direction=False)),
        verdict(fit_robust(source, reference)),
    )


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--tables", type=int, default=1000)
    parser.add_argument("--fits", type=int, default=2000)
    parser.add_argument("--only", choices=("accuracy", "coverage", "alarms", "directions", "outliers"))
    options = parser.parse_args()
    if options.only in (None, "accuracy"):
        accuracy(options.tables)
    if options.only in (None, "coverage"):
        coverage(options.fits)
    if options.only in (None, "alarms"):
        alarms(options.tables)
    if options.only in (None, "directions"):
        directions(options.tables)
    if options.only in (None, "outliers"):
        outliers(options.tables)


if __name__ == "__main__":
    main()
