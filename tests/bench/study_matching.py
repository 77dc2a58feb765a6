"""How many spots are paired right by their places alone, over many random bodies.

Usage: ``python tests/bench/study_matching.py [--trials 20] [--spots 14 40 100] [--noise 1 5 10] [--lost 0.3] [--seed 1]``

Every trial makes a body (spots in a box, or on a curved panel), loses a share of its spots, adds as many strangers, shuffles,
moves the rest by a random motion and adds noise along every axis. *right* is the share of the spots left that got their own
partner, over the trials that were matched; *wrong* counts matches with most pairs wrong: it must be 0. *strangers* is how
many of as many trials with two different bodies were matched at all: it must be 0 too.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.spatial.transform import Rotation

from respot.registration.errors import RegistrationError
from respot.registration.geometry_matching import match_by_geometry


def body(rng: np.random.Generator, n: int, kind: str) -> np.ndarray:
    """Spots of a made-up part [mm]."""
    if kind == "box":
        return rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    u, v = rng.uniform(-600, 600, n), rng.uniform(-400, 400, n)
    return np.stack([60 * np.cos(u / 400) + 20 * np.sin(v / 150), u, v], axis=1)


def moved(rng: np.random.Generator, points: np.ndarray, noise: float) -> np.ndarray:
    """The points after a random motion, with noise."""
    motion = Rotation.random(rng=rng)
    return motion.apply(points) + rng.uniform(-3000, 3000, 3) + noise * rng.normal(size=points.shape)


def study(kind: str, n: int, noise: float, lost: float, trials: int, seed: int) -> str:
    """One line of the table."""
    rng = np.random.default_rng(seed)
    matched = ambiguous = nothing = wrong = strangers = 0
    right: list[float] = []
    started = time.perf_counter()
    for trial in range(trials):
        source = body(rng, n, kind)
        kept = rng.permutation(n)[: round((1 - lost) * n)]
        others = np.vstack([source[kept], body(rng, n - len(kept), kind)])
        order = rng.permutation(len(others))
        truth = np.full(n, -1)
        truth[kept] = np.argsort(order)[: len(kept)]
        try:
            best = match_by_geometry(source, moved(rng, others[order], noise), seed=trial).best
        except RegistrationError as error:
            ambiguous += error.code == "AMBIGUOUS_MATCH"
            nothing += error.code == "NOT_CONGRUENT"
        else:
            agree = truth[best.source_rows] == best.reference_rows
            matched += 1
            wrong += bool(agree.mean() < 0.5)
            right.append(int(agree.sum()) / int((truth >= 0).sum()))
        try:
            match_by_geometry(body(rng, n, kind), moved(rng, body(rng, n, kind), noise), seed=trial)
            strangers += 1
        except RegistrationError:
            pass
    share = f"{np.mean(right):.3f}" if right else "-"
    each = (time.perf_counter() - started) / trials / 2
    return f"{kind:6} {n:5} {noise:6.1f} {matched:8} {share:>7} {wrong:6} {ambiguous:10} {nothing:8} {strangers:10} {each:8.2f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--spots", type=int, nargs="+", default=[14, 40, 100])
    parser.add_argument("--noise", type=float, nargs="+", default=[1.0, 5.0, 10.0])
    parser.add_argument("--lost", type=float, default=0.3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print("body   spots  noise  matched   right  wrong  ambiguous  nothing  strangers  s/match", flush=True)
    for kind in ("box", "panel"):
        for n in options.spots:
            for noise in options.noise:
                print(study(kind, n, noise, options.lost, options.trials, options.seed), flush=True)


if __name__ == "__main__":
    main()
