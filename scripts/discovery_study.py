"""How well effects are found, on simulated lines whose truth the engine never sees: ``discovery_study.py PART``.

The simulator shares no code with the engine, and its forms are not the engine's columns. Parts:

singles   one effect each, easy lines: 120 spots, 0.1 mm noise, guns turned over 40 degrees; leaving 0.3 to 3 mm
weak      the same, leaving 0.1 mm, and 0.05 mm
hard      40 to 80 spots, gun families, stations clustered in space, time in path order, 0.3 mm uneven noise
hidden    effects that the rigid part or the tool swallows: never named
pairs     two effects of the catalogue, easy lines; ``triples`` three
nothing   no effect, every column present: how often anything is claimed
outside   effects that the engine has no file for
heldout   held-out RMS against the noise-free truth, beside an oracle that knows the effects
coverage  how often 95 % intervals hold the truth, given the right model
time      seconds for 120 spots with 20 columns, and for 2,000 spots

A finding counts as the truth with the right axis, column, level, group or ids. "found": it is named, or it is first in
the list with at most 4 rivals that are not separated from it. Everything listed counts as claimed. "among 5": among at
most 5 explanations of the finding that is listed first. "nearest 5": among the first five that the report shows: that
finding and its rivals, then what was tried and not proved, the least likely to come by chance first.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread for each of our processes

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import RigidTransform

from respot.calibration.covariates import covariates_of
from respot.calibration.discovery.bank import Bank
from respot.calibration.discovery.discover import Discovery, discover
from respot.calibration.discovery.joint_fit import fit_jointly
from respot.calibration.discovery.records import tried_of
from respot.calibration.discovery.selection import Selection
from respot.calibration.effects.catalogue import columns_of, terms_of
from respot.calibration.effects.moved import moved
from respot.calibration.observations import Observations
from respot.kinematics.robots import find_robot
from respot.registration.exchanged import find_exchanged
from respot.registration.leave_one_out import without_folds
from respot.simulation import EFFECTS, OUTSIDE, Line, simulate

Array = NDArray[np.float64]

ROBOT = "kr210_r2700_extra"
NOISE = {"easy": 0.1, "hard": 0.3}
FAMILY = {"warmup": "drift"}
NO_STUDY = ("convention", "swapped_ids")
"""Found before this stage: names and conventions have studies of their own."""
HIDDEN = ("joint_zero@1", "link_length@c1", "joint_zero@6", "link_length@c4")


@dataclass(frozen=True)
class Claim:
    """An entry of ``effects``."""

    name: str
    where: Mapping[str, Any]
    named: bool
    rivals: tuple[tuple[str, Mapping[str, Any]], ...]


@dataclass(frozen=True)
class Trial:
    """What was true, and what was said."""

    truth: tuple[Mapping[str, Any], ...]
    claims: tuple[Claim, ...]
    tried: tuple[tuple[str, Mapping[str, Any]], ...]
    unexplained: bool
    seconds: float
    sigma: float


def observations_of(line: Line) -> Observations:
    """What the engine may see of a line."""
    texts = {name: [str(value) for value in values] for name, values in line.columns.items()}
    numbers = {
        name: np.asarray(values, dtype=np.float64) for name, values in line.columns.items() if values.dtype != object
    }
    external = line.external_axes
    # a rail carries the robot along the world's y
    travel = np.zeros(line.n) if external is None else external[:, 0]
    foot = RigidTransform.from_translation(travel[:, None] * np.array([0.0, 1.0, 0.0]))
    return Observations(
        line.positions,
        line.rotations,
        line.joints,
        line.measured_joints,
        find_robot(str(line.robot["name"])),
        base2source=foot,
        external_axes=external if external is not None and np.isfinite(external).any() else None,
        columns=covariates_of(texts, numbers, ())[0],
    )


def look(line: Line, *, known_noise: bool = True, nested: bool = False, draws: int = 1000) -> Discovery:
    """Run the engine on a line."""
    exchanged = find_exchanged(line.ids, line.positions, line.measured, seed=0)
    return discover(
        observations_of(line),
        line.measured[exchanged.permutation],
        inliers=exchanged.robust.inliers,
        noise=line.noise if known_noise else None,
        nested=nested,
        draws=draws,
    )


def trial(job: tuple[tuple[str, ...], int, str, int]) -> Trial:
    """Simulate and fit one line: effects, seed, layout, spots."""
    effects, seed, layout, spots = job
    rail = any(effect.startswith("rail") for effect in effects)
    line = simulate(ROBOT, spots, NOISE[layout], effects, seed, layout, rail=rail)
    start = time.perf_counter()
    found = look(line)
    claims = tuple(
        Claim(
            each.term.effect,
            each.term.where,
            each.named,
            tuple((rival.effect, rival.where) for rival in each.not_separated),
        )
        for each in found.accepted
    )
    tried = tuple((record["name"], record["where"]) for record in tried_of(found))
    return Trial(line.truth, claims, tried, found.unexplained.present, time.perf_counter() - start, found.fit.sigma)


def same(truth: Mapping[str, Any], name: str, where: Mapping[str, Any]) -> bool:
    """Whether a finding is a truth: its name, and its axis, parameter, column, level or ids."""
    if FAMILY.get(name, name) != FAMILY.get(truth["name"], truth["name"]):
        return False
    real = truth["where"]
    for key in ("axis", "parameter", "column"):
        if key in real and key in where and real[key] != where[key]:
            return False
        if key == "axis" and key in real and key not in where and "axes" not in where and name != "rail":
            return False
    return not ("level" in real and "level" in where and real["level"] != where["level"])


def found_in(one: Trial, truth: Mapping[str, Any]) -> bool:
    """Whether a truth is named, or listed with at most 4 rivals (first, where it is the only one)."""
    return any(
        same(truth, claim.name, claim.where) and (claim.named or (place < len(one.truth) and len(claim.rivals) <= 4))
        for place, claim in enumerate(one.claims)
    )


def among(one: Trial, truth: Mapping[str, Any]) -> bool:
    """Whether a truth is listed, or among the at most 5 explanations of what is listed first."""
    if not one.claims:
        return False
    every = [(one.claims[0].name, one.claims[0].where), *one.claims[0].rivals]
    return len(every) <= 5 and any(same(truth, name, where) for name, where in every)


def nearest(one: Trial, truth: Mapping[str, Any]) -> bool:
    """Whether a truth is among the first five of what a report shows, claimed or not."""
    every = [(claim.name, claim.where) for claim in one.claims[:1]] + [
        r for claim in one.claims[:1] for r in claim.rivals
    ]
    return any(same(truth, name, where) for name, where in [*every, *one.tried][:5])


def wrong(one: Trial, *, named: bool) -> bool:
    """Whether something is claimed (or called by name) that is not true."""
    # errors of all links hold one of the last link: that is a tool offset, and claiming one is right
    truths = [*one.truth, *({"name": "tool_offset", "where": {}} for t in one.truth if t["name"] == "link_geometry")]
    return any(
        (claim.named or not named) and not any(same(truth, claim.name, claim.where) for truth in truths)
        for claim in one.claims
    )


def each(jobs: Iterable[tuple[tuple[str, ...], int, str, int]]) -> list[Trial]:
    """Run jobs on all cores."""
    with ProcessPoolExecutor() as pool:
        return list(pool.map(trial, list(jobs), chunksize=1))


def described(claims: Sequence[Claim]) -> str:
    """Claims in one line."""
    return "; ".join(
        f"{c.name} {dict(c.where)}{' NAMED' if c.named else ''}{f' ({len(c.rivals)} rivals)' if c.rivals else ''}"
        for c in claims
    )


def _names() -> list[str]:
    return [name for name in EFFECTS if name not in NO_STUDY]


def _table(title: str, trials: Mapping[str, list[Trial]], verbose: bool) -> None:
    print(f"\n{title}")
    print(
        f"{'effect':16}{'n':>5}{'named':>8}{'found':>8}{'first':>8}{'among 5':>9}{'nearest 5':>11}{'wrong':>8}"
        f"{'wrong named':>13}"
    )
    every = [one for each_kind in trials.values() for one in each_kind]
    for name, some in [*trials.items(), ("all", every)]:
        rows = [
            [
                any(c.named and same(one.truth[0], c.name, c.where) for c in one.claims),
                found_in(one, one.truth[0]),
                bool(one.claims) and same(one.truth[0], one.claims[0].name, one.claims[0].where),
                among(one, one.truth[0]),
                nearest(one, one.truth[0]),
                wrong(one, named=False),
                wrong(one, named=True),
            ]
            for one in some
        ]
        shares = np.mean(rows, axis=0)
        print(
            f"{name:16}{len(some):5}{shares[0]:8.1%}{shares[1]:8.1%}{shares[2]:8.1%}{shares[3]:9.1%}{shares[4]:11.1%}"
            f"{shares[5]:8.1%}{shares[6]:13.1%}",
            flush=True,
        )
        if verbose and name != "all":
            for one in some:
                if not found_in(one, one.truth[0]) or wrong(one, named=False):
                    print(f"    {dict(one.truth[0]['where'])} s={one.sigma:.3f} {described(one.claims)}")
    print(f"median {np.median([one.seconds for one in every]):.1f} s")


def singles(seeds: range, verbose: bool) -> None:
    """Print how single effects are found on easy lines."""
    sizes = {seed: float(np.exp(np.random.default_rng((7, seed)).uniform(np.log(0.3), np.log(3.0)))) for seed in seeds}
    trials = {name: each((((f"{name}:{sizes[seed]:.3f}",), seed, "easy", 120)) for seed in seeds) for name in _names()}
    _table("single effects, easy lines, leaving 0.3 to 3 mm", trials, verbose)


def weak(seeds: range, verbose: bool) -> None:
    """Print how weak effects are found."""
    for size in (0.1, 0.05):
        trials = {name: each(((f"{name}:{size}",), seed, "easy", 120) for seed in seeds) for name in _names()}
        _table(f"single effects, easy lines, leaving {size} mm", trials, verbose)


def hard(seeds: range, verbose: bool) -> None:
    """Print how effects are found on hard lines."""
    spots = {seed: int(np.random.default_rng((8, seed)).integers(40, 81)) for seed in seeds}
    trials = {name: each(((f"{name}:0.3",), seed, "hard", spots[seed]) for seed in seeds) for name in _names()}
    _table("single effects, hard lines, leaving 0.3 mm", trials, verbose)


def hidden(seeds: range, verbose: bool) -> None:
    """Print whether hidden effects are ever named."""
    print("\neffects that the data hide")
    for name in HIDDEN:
        some = each(((f"{name}:2",), seed, "easy", 120) for seed in seeds)
        named = sum(any(claim.named for claim in one.claims) for one in some)
        right = sum(any(c.named and same(one.truth[0], c.name, c.where) for c in one.claims) for one in some)
        print(f"{name:16}{len(some):5} lines, named {named}, the hidden effect itself {right}", flush=True)
        if verbose:
            print("    " + str(Counter(described(one.claims) for one in some)))


def several(seeds: range, count: int, verbose: bool) -> None:
    """Print how pairs or triples of effects are found."""
    jobs = []
    for seed in seeds:
        dice = np.random.default_rng((9, count, seed))
        names = dice.permutation(_names())[:count]
        while len({FAMILY.get(str(name), str(name)) for name in names}) < count:
            names = dice.permutation(_names())[:count]
        sizes = np.exp(dice.uniform(np.log(0.3), np.log(3.0), count))
        jobs.append((tuple(f"{name}:{size:.3f}" for name, size in zip(names, sizes, strict=True)), seed, "easy", 120))
    some = each(jobs)
    both = [all(found_in(one, truth) for truth in one.truth) for one in some]
    print(
        f"\n{count} effects, {len(some)} lines: all found {np.mean(both):.1%}, something wrong claimed "
        f"{np.mean([wrong(one, named=False) for one in some]):.1%}, something wrong named "
        f"{np.mean([wrong(one, named=True) for one in some]):.1%}"
    )
    if verbose:
        for one, good in zip(some, both, strict=True):
            if not good or wrong(one, named=False):
                truths = [(t["name"], dict(t["where"]), round(t["left_rms"], 2)) for t in one.truth]
                print(f"    {truths} s={one.sigma:.3f}: {described(one.claims)}")


def nothing(seeds: range, verbose: bool) -> None:
    """Print how often anything is claimed where there is nothing."""
    some = each(((), seed, "easy", 120) for seed in seeds)
    claimed = [one for one in some if one.claims]
    print(f"\nnothing there, {len(some)} lines: something claimed in {len(claimed) / len(some):.2%}")
    print(f"structure left is said in {np.mean([one.unexplained for one in some]):.2%}")
    if verbose:
        for one in claimed:
            print(f"    {described(one.claims)}")


def outside(seeds: range, verbose: bool) -> None:
    """Print what is said of effects that are not in the catalogue."""
    print("\neffects outside of the catalogue, leaving 0.3 to 3 mm")
    sizes = {seed: float(np.exp(np.random.default_rng((7, seed)).uniform(np.log(0.3), np.log(3.0)))) for seed in seeds}
    print(f"{'effect':16}{'n':>5}{'wrong named':>13}{'unexplained or the right column':>33}")
    totals = defaultdict(list)
    for name in OUTSIDE:
        some = each((((f"{name}:{sizes[seed]:.3f}",), seed, "easy", 120)) for seed in seeds)
        for one in some:
            column = one.truth[0]["where"].get("column")
            right = [claim for claim in one.claims if column is not None and claim.where.get("column") == column]
            named = any(claim.named and claim not in right for claim in one.claims)
            totals[name].append((named, one.unexplained or bool(right)))
            if verbose and (named or not totals[name][-1][1]):
                print(
                    f"    {dict(one.truth[0]['where'])} {one.truth[0]['left_rms']:.2f} s={one.sigma:.3f} "
                    f"{described(one.claims)}"
                )
        shares = np.mean(totals[name], axis=0)
        print(f"{name:16}{len(some):5}{shares[0]:13.1%}{shares[1]:33.1%}", flush=True)
    shares = np.mean([row for rows in totals.values() for row in rows], axis=0)
    print(f"{'all':16}{'':5}{shares[0]:13.1%}{shares[1]:33.1%}")


def _oracle(line: Line, seen: Observations, folds: NDArray[np.intp]) -> Array:
    """Errors (n, 3) against the noise-free truth of a fit that knows the effects, each fold held out [mm]."""
    bank_terms = terms_of(seen)
    columns = columns_of(seen, bank_terms)
    fit = fit_jointly(seen, line.measured, (), np.ones(line.n, dtype=np.bool_))
    bank = Bank(bank_terms, columns, seen.positions)
    wanted = bank.project(fit.linear.ravel())
    every = np.ones(len(bank_terms), dtype=np.bool_)
    selection = Selection(bank, wanted, line.noise, every, draws=1, seed=0)
    chosen: list[int] = []
    for truth in line.truth:
        own = [k for k, term in enumerate(bank_terms) if same(truth, term.effect, term.where)]
        chosen.append(min(own, key=lambda k: selection.state([*chosen, k], line.noise).criterion))
    terms = [bank_terms[k] for k in chosen]
    errors = np.full((line.n, 3), np.nan)
    for fold in np.unique(folds):
        rest, out = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        part = seen.rows(rest)
        model = fit_jointly(part, line.measured[rest], terms, np.ones(len(rest), dtype=np.bool_))
        places, _ = moved(seen.rows(out), model.terms, model.values)
        errors[out] = places @ model.rotation.T + model.translation - line.measured_true[out]
    return errors


def _against_oracle(seed: int) -> tuple[float, float, float]:
    dice = np.random.default_rng((11, seed))
    names = dice.permutation(_names())[: int(dice.integers(1, 3))]
    effects = tuple(f"{name}:{np.exp(dice.uniform(np.log(0.3), np.log(3.0))):.3f}" for name in names)
    line = simulate(ROBOT, 120, NOISE["easy"], effects, seed, "easy", rail="rail" in names)
    found = look(line, nested=True, draws=300)
    folds = found.nested_folds
    if found.nested is None or folds is None:
        return float("nan"), float("nan"), float("nan")
    ours = found.nested + line.measured - line.measured_true
    known = _oracle(line, observations_of(line), folds)
    before = without_folds(line.positions, line.measured, folds) + line.measured - line.measured_true
    first, second, third = (float(np.sqrt(np.mean(np.sum(e**2, axis=1)))) for e in (before, ours, known))
    return first, second, third


def against_oracle(seeds: range, verbose: bool) -> None:
    """Print held-out errors against the noise-free truth beside an oracle."""
    with ProcessPoolExecutor() as pool:
        rows = np.array(list(pool.map(_against_oracle, seeds)))
    rows = rows[np.isfinite(rows).all(axis=1)]
    before, ours, known = np.median(rows, axis=0)
    ratios = rows[:, 1] / rows[:, 2]
    print(
        f"\nheld out, against the noise-free truth, medians of {len(rows)} lines with one or two effects: rigid "
        f"{before:.3f} mm, ours {ours:.4f} mm, an oracle that knows the effects {known:.4f} mm; ratio: median "
        f"{np.median(ratios):.3f}, 90 % below {np.quantile(ratios, 0.9):.3f}"
    )
    if verbose:
        print("    " + " ".join(f"{ratio:.2f}" for ratio in np.sort(ratios)))


TRUE_VALUES: dict[str, Callable[[Mapping[str, Any]], list[float]]] = {
    "joint_zero": lambda parameters: [parameters["zero_deg"]],
    "tool_offset": lambda parameters: list(parameters["offset_mm"]),
    "link_length": lambda parameters: [parameters["error_mm"]],
    "scale": lambda parameters: [parameters["per_mille"]],
}


def coverage(seeds: range, verbose: bool) -> None:
    """Print how often 95 % intervals hold the truth, given the right model."""
    del verbose
    print("\n95 % intervals of parameters that hold the truth, given the right model")
    for name, values in TRUE_VALUES.items():
        held: list[bool] = []
        for seed in seeds:
            line = simulate(ROBOT, 120, NOISE["easy"], (f"{name}:1",), seed, "easy")
            seen = observations_of(line)
            term = next(t for t in terms_of(seen) if same(line.truth[0], t.effect, t.where))
            fit = fit_jointly(seen, line.measured, [term], np.ones(line.n, dtype=np.bool_))
            reach = stats.t.ppf(0.975, fit.free) * fit.value_sd[0]
            held += (np.abs(fit.values[0] - np.array(values(line.truth[0]["parameters"]))) <= reach).tolist()
        print(f"{name:16}{len(held):6} intervals, {np.mean(held):.1%} hold", flush=True)


def seconds(seeds: range, verbose: bool) -> None:
    """Print how long a search takes, with errors of spots that took no part."""
    del seeds, verbose
    for spots in (120, 2000):
        line = simulate(ROBOT, spots, NOISE["easy"], ("joint_zero@3:0.8", "tip_wear:0.6"), 3, "easy")
        start = time.perf_counter()
        found = look(line, nested=True)
        names = ", ".join(each.term.label for each in found.accepted)
        print(f"{spots} spots, {len(line.columns)} columns: {time.perf_counter() - start:.1f} s ({names})", flush=True)


def main() -> None:
    """Run one part."""
    parts: dict[str, Callable[[range, bool], None]] = {
        "singles": singles,
        "weak": weak,
        "hard": hard,
        "hidden": hidden,
        "pairs": lambda seeds, verbose: several(seeds, 2, verbose),
        "triples": lambda seeds, verbose: several(seeds, 3, verbose),
        "nothing": nothing,
        "outside": outside,
        "heldout": against_oracle,
        "coverage": coverage,
        "time": seconds,
    }
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=parts)
    parser.add_argument("--seeds", type=int, default=50, help="lines of each kind")
    parser.add_argument("--first", type=int, default=5000, help="first seed; tuning used seeds below 1000")
    parser.add_argument("--verbose", action="store_true", help="show what was missed")
    chosen = parser.parse_args()
    parts[chosen.part](range(chosen.first, chosen.first + chosen.seeds), chosen.verbose)


if __name__ == "__main__":
    main()
