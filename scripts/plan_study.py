"""What planned measurements are worth, on simulated lines whose truth the planner never sees: ``plan_study.py``.

Each line hides one effect. A few spots of one corner are measured first, so that several causes explain them; of the
rest `respot plan` picks some. Then the fit of the first with the planned spots stands beside fits with as many spots
drawn at random, and with all. Prints for each: how often the truth is listed first; what share of the rivals that the
first spots did not tell from it lose clearly now (no other cause is listed in the effect's place, and the rival is not
among those that are near); how often the truth is named; and the RMS error of the model over all spots against the
truth without noise. Of the pairs that the plan promised to separate: how many it did, nine of ten are promised.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from respot.calibration.final_model import precise
from respot.calibration.planning import plan_source
from respot.calibration.prediction import UseOptions, predict_source
from respot.calibration.source_fit import FitOptions, SourceFit, fit_source
from respot.kinematics.robots import find_robot
from respot.simulation import Line, files_of, simulate

Rows = NDArray[np.intp]

EFFECTS = ("joint_zero@2", "joint_zero@3", "gravity_sag", "link_length@a2", "joint_zero@5", "gun_sag", "joint_zero@4")
SPOTS, FIRST, CORNER = 100, 14, 30
RANDOM = 3
NOISE = 0.25
LAYOUT = "hard"
ROBOT = "kr210_r2700_extra"


def fitted(folder: Path, line: Line, rows: Rows, name: str) -> tuple[SourceFit, Path]:
    """Fit some spots of a line, and store the calibration."""
    lines = (folder / "measured.csv").read_text().splitlines()
    wanted = {line.ids[row] for row in rows}
    some = folder / f"{name}.csv"
    some.write_text("\n".join([lines[0], *(text for text in lines[1:] if text.split(",")[0] in wanted)]) + "\n")
    options = FitOptions("measured", effects="auto", noise=line.noise, robot=find_robot(ROBOT))
    fit = fit_source(folder / "programmed.csv", some, options)
    stored = folder / f"{name}.json"
    precise(fit.fit).save(stored)
    return fit, stored


def verdict(fit: SourceFit, truth: Mapping[str, Any], asked: Sequence[tuple[str, str]]) -> dict[str, float]:
    """What a fit says of the truth, and which of some pairs of causes it tells apart clearly."""
    found = fit.fit.discovery
    accepted = () if found is None else found.accepted
    first = accepted[0] if accepted else None
    right = first is not None and first.term.effect == truth["name"]
    if right and first is not None and "axis" in truth["where"] and "axis" in first.term.where:
        right = first.term.where["axis"] == truth["where"]["axis"]
    near = {each.term.label: {term.label for term, _ in each.table.near} for each in accepted}
    apart = [effect in near and rival not in near[effect] and rival not in near for effect, rival in asked]
    return {
        "right": float(right),
        "separated": float(np.mean(apart)) if apart else np.nan,
        "named": float(right and first is not None and first.named),
        **{" / ".join(pair): float(done) for pair, done in zip(asked, apart, strict=True)},
    }


def error(folder: Path, line: Line, stored: Path) -> float:
    """RMS error of a calibration over all spots against the truth without noise [mm]."""
    told = predict_source(folder / "programmed.csv", stored, UseOptions(robot=find_robot(ROBOT))).prediction
    places = dict(zip(line.ids, line.measured_true, strict=True))
    apart = np.array([places[name] for name in told.ids]) - told.positions
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def trial(seed: int, count: int) -> dict[str, list[dict[str, float]]] | None:
    """One line; None where the first spots show no effect, or show it clearly: nothing to plan for."""
    line = simulate(ROBOT, SPOTS, NOISE, [f"{EFFECTS[seed % len(EFFECTS)]}:0.7"], seed, LAYOUT, columns=False)
    chance = np.random.default_rng(seed)
    corner = np.argsort(np.linalg.norm(line.positions - line.positions[chance.integers(line.n)], axis=1))[:CORNER]
    first = chance.permutation(corner)[:FIRST]
    rest = np.setdiff1d(np.arange(line.n), first)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, content in files_of(line).items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        truth = line.truth[0]
        fit, stored = fitted(folder, line, first, "first")
        information = precise(fit.fit).information
        if information is None or not information.rivals:
            return None
        plan = plan_source(folder / "programmed.csv", stored, count, UseOptions(robot=find_robot(ROBOT))).plan
        named = {name: row for row, name in enumerate(line.ids)}
        planned = np.array([named[spot.id] for spot in plan.spots])
        sets: dict[str, Sequence[Rows]] = {
            "planned": [np.concatenate([first, planned])],
            "random": [np.concatenate([first, chance.permutation(rest)[:count]]) for _ in range(RANDOM)],
            "all": [np.arange(line.n)],
        }
        asked = [pair.names for pair in plan.pairs if pair.possible]
        kept = [" / ".join(pair.names) for pair in plan.pairs if pair.promised]
        found = {"first": [{**verdict(fit, truth, asked), "error": error(folder, line, stored)}]}
        for what, some in sets.items():
            found[what] = []
            for rows in some:
                fit, stored = fitted(folder, line, rows, what)
                found[what].append({**verdict(fit, truth, asked), "error": error(folder, line, stored)})
        found["promised"] = [{"kept": found["planned"][0][pair]} for pair in kept]
    return found


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=20)
    parser.add_argument("--count", type=int, default=4)
    asked = parser.parse_args()
    every: dict[str, list[dict[str, float]]] = defaultdict(list)
    lines = 0
    for seed in range(asked.seeds):
        found = trial(seed, asked.count)
        if found is None:
            print(f"seed {seed}: the first spots leave nothing to tell apart", flush=True)
            continue
        lines += 1
        for what, records in found.items():
            every[what] += records
        print(f"seed {seed} {EFFECTS[seed % len(EFFECTS)]}: {shown(found)}", flush=True)
    promised = every.pop("promised", [])
    print(f"\n{lines} lines, {FIRST} spots of one corner first, then {asked.count} more")
    print("              truth first  pairs separated  named  error, mm")
    for what, records in every.items():
        right, separated, named = (
            f"{np.nanmean([record[key] for record in records]):.0%}" for key in ("right", "separated", "named")
        )
        off = np.median([record["error"] for record in records])
        print(f"{what:12}  {right:>11}  {separated:>15}  {named:>5}  {off:9.3f}")
    print(f"promised pairs: {len(promised)}, separated: {sum(record['kept'] for record in promised):.0f}")


def shown(found: Mapping[str, Sequence[Mapping[str, float]]]) -> str:
    """Pairs separated, by set."""
    shares = {what: np.mean([each["separated"] for each in some]) for what, some in found.items() if what != "promised"}
    return ", ".join(f"{what} {share:.0%}" for what, share in shares.items())


if __name__ == "__main__":
    main()
