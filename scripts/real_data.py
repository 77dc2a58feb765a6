"""How far the search for effects carries on measured robots: ``real_data.py FOLDER [--name NAME ...]``.

FOLDER holds records of robots whose joints are known: ``NAME_programmed.csv`` (``id,j1..`` and any further columns),
``NAME_measured.csv`` (``id,x,y,z`` and any further columns) and the robot, ``NAME.toml`` or the only ``.toml`` of the
folder (../shared/data/ur10, or what scripts/public_tables.py writes). The source's poses are those of the flange.

For each record rows are held out that take no part in choosing or in fitting: half of them at random, for each seed,
and contiguous blocks of rows in turn. What is left is given to the engine as `respot fit` would give it. Printed is,
for each split, the mean and the largest 3D error of the rows held out [mm] with base and tool only and with the whole
catalogue; the noise per coordinate that the engine believes it leaves, inliers only [mm]; seconds of processor time;
and what was found, where, in the engine's order (``~n``: not separated from n rivals; ``!``: structure is left).

``--drop COLUMN`` hides a column from the engine; ``--only EFFECT`` looks for these effects alone; ``--tool-first``
gives the engine the tool's tip in the place of the flange: the offset that the same rows show with base and tool only;
``--detail`` adds to each finding its values and rivals. scripts/ladder.py is the independent reference: the same
splits, one model for all.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.discover import Accepted, Discovery, discover
from respot.calibration.discovery.joint_fit import JointFit, fit_jointly
from respot.calibration.effects.catalogue import terms_of
from respot.calibration.effects.moved import moved
from respot.calibration.observations import Observations
from respot.calibration.prediction import table_of_joints
from respot.calibration.source_observations import SourceObservations
from respot.issues import BadInputError
from respot.kinematics.robot_file import read_robot_file
from respot.registration.robust import fit_robust
from respot.spots import read_source

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

BARE = frozenset({"tool_offset"})


@dataclass(frozen=True)
class Record:
    """One record: what is known of n spots, and where they were measured (n, 3) [mm]."""

    name: str
    robot: str
    observations: Observations
    reference: Array


@dataclass(frozen=True)
class Trial:
    """One split: errors of the rows held out [mm] with base and tool only and with all effects."""

    title: str
    fitted: int
    bare: Array
    whole: Array
    found: Discovery
    seconds: float


def records_of(folder: Path, names: Collection[str], drop: Collection[str]) -> Iterator[Record]:
    """Records of a folder, those named or all."""
    suffix = "_programmed.csv"
    for path in sorted(folder.glob(f"*{suffix}")):
        name = path.name.removesuffix(suffix)
        if not names or name in names:
            yield read(folder, name, drop)


def read(folder: Path, name: str, drop: Collection[str] = ()) -> Record:
    """Read a record; rows are paired by id, in the order of the programmed table."""
    file = folder / f"{name}.toml"
    robots = [file] if file.is_file() else sorted(folder.glob("*.toml"))
    if len(robots) != 1:
        raise SystemExit(f"{folder}: no {name}.toml, and {len(robots)} other robot files")
    robot = read_robot_file(robots[0])
    source, _ = table_of_joints(folder / f"{name}_programmed.csv", robot)
    reference = read_source(folder / f"{name}_measured.csv")
    places = {spot.casefold(): row for row, spot in enumerate(reference.spots.ids)}
    pairs = [(row, places[spot.casefold()]) for row, spot in enumerate(source.spots.ids) if spot.casefold() in places]
    own, theirs = np.array(pairs, dtype=np.intp).T
    gathered = SourceObservations(source, reference, robot)
    observations = gathered.of(own, theirs)
    for issue in gathered.issues:
        print(f"  {issue.code}: {issue.message}")
    kept = {column: values for column, values in observations.columns.items() if column not in drop}
    return Record(name, robot.name, replace(observations, columns=kept), reference.spots.positions[theirs])


def random_splits(count: int, share: float, seeds: int) -> Iterator[tuple[str, Rows]]:
    """Rows held out at random; the same as in ladder.py."""
    for seed in range(seeds):
        order = np.random.default_rng(seed).permutation(count)
        tested = count - int((1.0 - share) * count + 1e-9)
        yield f"random {seed}", np.sort(order[count - tested :])


def block_splits(count: int, blocks: int) -> Iterator[tuple[str, Rows]]:
    """Contiguous blocks of rows held out in turn."""
    for number, block in enumerate(np.array_split(np.arange(count), blocks), start=1):
        yield f"block {number}", block


def searched(observations: Observations, reference: Array, effects: frozenset[str] | None) -> Discovery:
    """Look for effects as `respot fit` does, without looking at any other spot."""
    start = fit_robust(observations.positions, reference, seed=0).inliers
    return discover(observations, reference, inliers=start, effects=effects, nested=False)


def tool_alone(observations: Observations, reference: Array) -> JointFit:
    """Base and tool: as the search for the tool finds them, or of all rows where it refuses the tool."""
    found = searched(observations, reference, BARE).fit
    if found.terms:
        return found
    return fit_jointly(observations, reference, terms_of(observations, BARE), np.ones(len(reference), dtype=np.bool_))


def errors(fit: JointFit, observations: Observations, reference: Array) -> Array:
    """Distances (n,) of spots from where the model puts them [mm]."""
    places, _ = moved(observations, fit.terms, fit.values)
    apart = places @ fit.rotation.T + fit.translation - reference
    return np.asarray(np.linalg.norm(apart, axis=1), dtype=np.float64)


def at_tip(observations: Observations, tool: JointFit) -> Observations:
    """Observations of the tool's tip, by base and tool alone."""
    if observations.rotations is None:
        return observations
    return replace(observations, positions=observations.positions + observations.rotations.apply(tool.values[0]))


def trial(record: Record, title: str, out: Rows, effects: frozenset[str] | None, tool_first: bool = False) -> Trial:
    """Fit all rows but some, and judge these."""
    rest = np.setdiff1d(np.arange(len(record.reference)), out)
    fit_on, judged_on = record.observations.rows(rest), record.observations.rows(out)
    known, hidden = record.reference[rest], record.reference[out]
    first = tool_alone(fit_on, known)
    bare = errors(first, judged_on, hidden)
    if tool_first:
        fit_on, judged_on = at_tip(fit_on, first), at_tip(judged_on, first)
    begin = time.process_time()
    found = searched(fit_on, known, effects)
    seconds = time.process_time() - begin
    return Trial(title, len(rest), bare, errors(found.fit, judged_on, hidden), found, seconds)


def short(each: Accepted) -> str:
    """One finding in a few letters."""
    form = {name: value for name, value in each.term.form.items() if name in ("leading", "weights")}
    details = f"[{','.join(str(value) for value in form.values())}]" if form else ""
    rivals = f"~{len(each.not_separated)}" if each.not_separated else ""
    return f"{each.term.label}{details}{rivals}{' NAMED' if each.named else ''}"


def show(one: Trial, detail: bool) -> None:
    """Print a split."""
    fit = one.found.fit
    said = "; ".join(short(each) for each in one.found.accepted) or "nothing"
    out = int(np.count_nonzero(~fit.inliers))
    print(
        f"{one.title:10} {one.fitted:5} {len(one.whole):5} {one.bare.mean():8.3f} {one.whole.mean():8.3f} "
        f"{one.whole.max():8.2f} {fit.sigma:7.3f} {out:5} {one.seconds:6.0f}  {said}"
        f"{' !' if one.found.unexplained.present else ''}",
        flush=True,
    )
    if detail:
        for each in one.found.accepted:
            print(f"    {short(each)}, p {each.p_value:.2g}, rivals: {[term.label for term in each.not_separated]}")
            pairs = zip(each.term.parameters, each.values, each.sd, strict=True)
            rows = [f"{parameter.name} {value:.4g} +- {sd:.2g} {parameter.unit}" for parameter, value, sd in pairs]
            print(f"        {', '.join(rows[:18])}{' ...' if len(rows) > 18 else ''}")


def study(record: Record, options: argparse.Namespace) -> None:
    """Print the table of a record."""
    count = len(record.reference)
    columns = ", ".join(record.observations.columns) or "none"
    print(f"\n{record.name}: {count} rows, {record.robot}; further columns: {columns}")
    head = f"{'held out':10} {'fit':>5} {'judge':>5} {'base+tool':>8} {'effects':>8} {'largest':>8} {'sigma':>7}"
    print(f"{head} {'out':>5} {'s':>6}  found")
    effects = frozenset(options.only) if options.only else None
    for splits in (
        random_splits(count, options.test, options.seeds),
        block_splits(count, options.blocks) if options.blocks else iter(()),
    ):
        some: list[Trial] = []
        for title, out in splits:
            some.append(trial(record, title, out, effects, options.tool_first))
            show(some[-1], options.detail)
        if some:
            total(some)


def total(some: Sequence[Trial]) -> None:
    """Print all rows of all splits together, and what was found how often."""
    bare, whole = (np.concatenate([getattr(one, side) for one in some]) for side in ("bare", "whole"))
    often = Counter(label for one in some for label in {each.term.label for each in one.found.accepted})
    said = ", ".join(f"{label} {times}/{len(some)}" for label, times in often.most_common())
    print(f"{'all':10} {'':5} {len(whole):5} {bare.mean():8.3f} {whole.mean():8.3f} {whole.max():8.2f} {'':20}  {said}")


def main() -> None:
    """Print the table of every record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--name", action="append", default=[], help="this record only; may be given again")
    parser.add_argument("--test", type=float, default=0.5, help="share held out in the random splits")
    parser.add_argument("--seeds", type=int, default=2, help="random splits")
    parser.add_argument("--blocks", type=int, default=5, help="blocks of rows; 0: none")
    parser.add_argument("--drop", action="append", default=[], metavar="COLUMN", help="hide a column")
    parser.add_argument("--only", action="append", default=[], metavar="EFFECT", help="look for these effects alone")
    parser.add_argument("--tool-first", action="store_true", help="the source's poses are those of the tip")
    parser.add_argument("--detail", action="store_true", help="values and rivals of each finding")
    options = parser.parse_args()
    try:
        for record in records_of(options.folder, options.name, options.drop):
            study(record, options)
    except BadInputError as error:
        raise SystemExit(f"{error}") from error


if __name__ == "__main__":
    main()
