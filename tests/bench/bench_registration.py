"""How fast the robust fit and the consensus start are, against one Kabsch in numpy and RANSAC of skimage, in one run.

Usage: ``python tests/bench/bench_registration.py [--pairs 1000000] [--repeat 5]``

Every time is the best of the repetitions, taken in turn so that a slow moment hits both sides; each line is a ratio of
two of them with the bound it should keep. RANSAC is given the noise, as its threshold; both fit the pairs within that
threshold by least squares at the end, ours twice. skimage ends its trials early; both comparisons are made: as many trials as
it takes, and 1,000 for both. Memory is the highest traced allocation beside the input, in arrays of the input's size.
"""

from __future__ import annotations

import argparse
import time
import tracemalloc
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from respot.registration.consensus import consensus_transform
from respot.registration.robust import fit_robust

try:
    from skimage.measure import fit as skimage_fit
    from skimage.measure import ransac
    from skimage.transform import EuclideanTransform
except ImportError:
    ransac = None

Array = NDArray[np.float64]
NOISE, REACH = 0.3, 4 * 0.3
TABLES = 40


def best(calls: Mapping[str, Callable[[], object]], repeat: int) -> dict[str, float]:
    """Shortest time of each call [s]."""
    times = dict.fromkeys(calls, np.inf)
    for _ in range(repeat):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            times[name] = min(times[name], time.perf_counter() - start)
    return times


def table(seed: int, n: int, bad: float) -> tuple[Array, Array, Array]:
    """Source, reference and true reference; ``bad`` of the spots are 5 to 40 mm off."""
    dice = np.random.default_rng(seed)
    source = dice.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    turn = kabsch(dice.normal(size=(9, 3)), dice.normal(size=(9, 3)))[0]
    true = source @ turn.T + dice.uniform(-3000, 3000, 3)
    reference = true + NOISE * dice.normal(size=(n, 3))
    rows = dice.permutation(n)[: round(bad * n)]
    way = dice.normal(size=(len(rows), 3))
    reference[rows] += way * (dice.uniform(5, 40, len(rows)) / np.linalg.norm(way, axis=1))[:, None]
    return source, reference, true


def kabsch(source: Array, reference: Array) -> tuple[Array, Array]:
    """Rotation and translation by the textbook."""
    first, second = source.mean(axis=0), reference.mean(axis=0)
    left, _, right = np.linalg.svd((source - first).T @ (reference - second))
    right[2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))
    rotation = (left @ right).T
    return rotation, second - rotation @ first


def consensus(source: Array, reference: Array, trials: int) -> tuple[Array, Array]:
    """Our start, then least squares over what lies within the threshold."""
    rotation, translation = consensus_transform(source, reference, seed=0, trials=trials)
    for _ in range(2):
        near = np.linalg.norm(source @ rotation.T + translation - reference, axis=1) < REACH
        rotation, translation = kabsch(source[near], reference[near])
    return rotation, translation


def peer(source: Array, reference: Array, trials: int) -> tuple[tuple[Array, Array], int]:
    """RANSAC of skimage, and how many trials it took."""
    taken = 0

    def count(*_: object) -> bool:
        nonlocal taken
        taken += 1
        return True

    model, _ = ransac((source, reference), EuclideanTransform, 3, REACH, is_data_valid=count, max_trials=trials, rng=0)
    return (model.params[:3, :3], model.params[:3, 3]), taken


def error(source: Array, true: Array, transform: tuple[Array, Array]) -> float:
    """Largest error of a transform over all pairs [mm]."""
    return float(np.linalg.norm(source @ transform[0].T + transform[1] - true, axis=1).max())


def large(pairs: int, repeat: int) -> None:
    """Robust fit of many pairs against one Kabsch."""
    source, reference, true = table(1, pairs, 0.3)
    times = best({"kabsch": lambda: kabsch(source, reference), "robust": lambda: fit_robust(source, reference)}, repeat)
    tracemalloc.start()
    fit = fit_robust(source, reference)
    peak = tracemalloc.get_traced_memory()[1] / source.nbytes
    tracemalloc.stop()
    print(f"{pairs} pairs, 30 % bad: Kabsch {1e3 * times['kabsch']:.1f} ms, robust {1e3 * times['robust']:.1f} ms")
    print(f"largest error of the robust fit {error(source, true, (fit.rigid.rotation, fit.rigid.translation)):.4f} mm")
    show("robust fit / one Kabsch", times["robust"] / times["kabsch"], "<= 15")
    show("memory, arrays of the input's size", peak, "<= 6")


def small(repeat: int) -> None:
    """The consensus start against RANSAC at 1,000 pairs."""
    if ransac is None:
        print("RANSAC of skimage: not compared, scikit-image is not installed (pip install scikit-image)")
        return
    source, reference, _ = table(2, 1000, 0.3)
    early = skimage_fit._dynamic_max_trials
    for forced in (False, True):
        skimage_fit._dynamic_max_trials = (lambda *_: np.inf) if forced else early
        taken = peer(source, reference, 1000)[1]
        times = best(
            {
                "ours": lambda trials=taken: consensus(source, reference, trials),
                "peer": lambda: peer(source, reference, 1000),
            },
            repeat,
        )
        tables = [table(seed, 1000, 0.3) for seed in range(10, 10 + TABLES)]
        ours = np.array([error(a, true, consensus(a, b, taken)) for a, b, true in tables])
        theirs = np.array([error(a, true, peer(a, b, 1000)[0]) for a, b, true in tables])
        print(
            f"1000 pairs, 30 % bad, {taken} trials: RANSAC {1e3 * times['peer']:.1f} ms, "
            f"consensus {1e3 * times['ours']:.1f} ms; median error of {TABLES} tables "
            f"{np.median(theirs):.4f} and {np.median(ours):.4f} mm"
        )
        show("RANSAC / consensus, time", times["peer"] / times["ours"], ">= 5")
        show("consensus / RANSAC, error, median of ratios", float(np.median(ours / theirs)), "<= 1")
    skimage_fit._dynamic_max_trials = early


def show(what: str, ratio: float, bound: str) -> None:
    """Print a ratio and what it should keep."""
    print(f"  {what:42} {ratio:8.2f} {bound:>8}", flush=True)


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--pairs", type=int, default=1_000_000)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    large(options.pairs, options.repeat)
    small(options.repeat)


if __name__ == "__main__":
    main()
