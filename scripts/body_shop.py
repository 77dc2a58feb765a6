"""Four calibration records of a body shop, and what may be behind their residuals: ``body_shop.py FOLDER``.

The folder holds pairs ``NAME_programmed.csv`` (poses) and ``NAME_measured.csv`` (points). For each: spots, in-sample
and leave-one-out RMS, the offset with its 95 % intervals; all spots by least squares, and what the robust fit keeps.
Then what deleting the worst spot, again and again, does to the two errors: the first falls by itself, the second
tells ("one spot alone": it determines a part of the model by itself), and the last column says how far the deleted
spots are from where the rest puts them.

Last, effects of the arm. The robots are not stated: every built-in robot of the make (by the first letters of NAME)
is tried that reaches all poses in one and the same posture of arm and wrist, the poses being those of the flange in
the robot's base; of postures the one in front with the elbow up, or all with ``--every-posture``. For each: what the
search finds beside the rigid part (``~``: rivals that are not separated); RMS with rigid part and tool only, before,
and with what is found, after: leave-one-out of the structure found with all spots, and of spots that took no part in
choosing or fitting ("chosen without", five folds); spots taken for outliers ("out"). Then what all robots agree on.
The poses are those of the flange, up to a metre from the tip; ``--tool-first`` gives the search the tip that rigid
part and tool alone show. ``--noise`` is what a person would have to know for anything lasting to be named; a name that
a rival equals would be printed as VIOLATION.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import RigidTransform

from respot.calibration import effects_model
from respot.calibration.discovery.discover import Accepted, Discovery, discover
from respot.calibration.discovery.heldout import folds_of
from respot.calibration.discovery.joint_fit import JointFit, fit_jointly
from respot.calibration.effects.catalogue import terms_of
from respot.calibration.effects.moved import moved
from respot.calibration.effects.tool_fit import ToolFit, fit_tool, leave_one_out_tool
from respot.calibration.observations import Observations
from respot.calibration.source_fit import FitOptions, fit_source
from respot.calibration.spot_fit import SpotFit
from respot.kinematics.opw import LENGTHS, OpwRobot
from respot.kinematics.robots import built_in_robots
from respot.registration.statistics import rms

Array = NDArray[np.float64]

DELETIONS = 7
MAKES = {"abb": "irb", "kuka": "kr"}
"""How the names of a make's robots begin, by the first letters of a record's name."""
POSTURES = ("in front, elbow up", "in front, elbow down", "reaching back", "reaching back, other elbow")
BARE = frozenset({"tool_offset"})


@dataclass(frozen=True)
class Candidate:
    """A robot that may be the one of a record, in one posture; joints (n, 6) [deg]."""

    names: tuple[str, ...]
    robot: OpwRobot
    posture: str
    joints: Array


@dataclass(frozen=True)
class Search:
    """What was looked at, and what was found: the tool by itself, and all effects."""

    observations: Observations
    bare: JointFit
    found: Discovery


@dataclass(frozen=True)
class Guess:
    """What the search finds with a candidate.

    ``fit`` is what was found, with the tool; ``without`` (n, 2) are errors of spots that took part in nothing [mm], of
    the tool by itself and of all effects.
    """

    title: str
    bare: JointFit
    found: Discovery
    fit: JointFit
    without: Array


def fitted(folder: Path, name: str) -> SpotFit:
    """Fit a record as `respot fit --measured` does."""
    options = FitOptions(kind="measured", effects="auto")
    return fit_source(folder / f"{name}_programmed.csv", folder / f"{name}_measured.csv", options).fit


def tools_of(fit: SpotFit) -> NDArray[np.float64]:
    """Tool orientations (n, 3, 3) of a record."""
    if fit.source_rotations is None:
        sys.exit("the poses have no orientations")
    return fit.source_rotations.as_matrix()


def row(title: str, fit: ToolFit, tools: NDArray[np.float64]) -> str:
    """Line of the table."""
    left = leave_one_out_tool(fit, tools)
    reach = stats.t.ppf(0.975, fit.degrees_of_freedom) * np.sqrt(np.diag(fit.covariance)[6:])
    offset = "  ".join(f"{value:8.2f} +- {half:5.2f}" for value, half in zip(fit.offset, reach, strict=True))
    kept = fit.inliers
    worst = float(np.linalg.norm(left[kept], axis=1).max())
    return (
        f"{title:26} {int(kept.sum()):3} {rms(fit.residuals[kept]):9.3f} {rms(left[kept]):9.3f} {worst:9.3f}   {offset}"
    )


def deletions(fit: SpotFit, tools: NDArray[np.float64]) -> None:
    """Delete the spot with the largest residual, seven times over."""
    kept = np.ones(len(fit.ids), dtype=np.bool_)
    print(f"  {'deleted':12} {'left':>4} {'in-sample':>10} {'leave-one-out':>14} {'RMS of the deleted':>19}")
    name = "none"
    for _ in range(DELETIONS + 1):
        found = fit_tool(fit.source, tools, fit.reference, kept)
        left = leave_one_out_tool(found, tools)
        gone = f"{rms(found.residuals[~kept]):19.3f}" if not kept.all() else f"{'-':>19}"
        held = rms(left[kept])
        said = f"{held:14.3f}" if np.isfinite(held) else f"{'one spot alone':>14}"
        print(f"  {name:12} {int(kept.sum()):4} {rms(found.residuals[kept]):10.3f} {said} {gone}")
        worst = int(np.argmax(np.where(kept, np.linalg.norm(found.residuals, axis=1), -1.0)))
        kept[worst], name = False, fit.ids[worst]


def candidates(fit: SpotFit, make: str, every_posture: bool) -> Iterator[Candidate]:
    """Built-in robots of a make that reach all spots in one posture; those of equal lengths once."""
    if fit.source_rotations is None:
        return
    poses = RigidTransform.from_components(fit.source, fit.source_rotations)
    alike: dict[tuple[float, ...], list[str]] = {}
    for name, built_in in built_in_robots().items():
        model = built_in.model
        if name.startswith(make):
            numbers = (*(getattr(model, length) for length in LENGTHS), *model.offsets_deg, *model.signs)
            alike.setdefault((*numbers, model.coupled_23), []).append(name)
    for names in alike.values():
        robot = built_in_robots()[names[0]].model
        # without its turned-over wrist, which moves the same axes of the same arm by the same angles
        reached = np.isfinite(robot.inverse(poses)[:, :4]).all(axis=(0, 2))
        for branch in np.flatnonzero(reached).tolist():
            if branch == 0 or every_posture:
                yield Candidate(tuple(names), robot, POSTURES[branch], joints_of(robot, poses, branch))


def joints_of(robot: OpwRobot, poses: RigidTransform, branch: int) -> Array:
    """Joints (n, 6) of one posture, each with the full turns that bring it nearest to the middle of all [deg]."""
    first = robot.inverse(poses)[:, branch]
    middle = np.degrees(np.angle(np.exp(1j * np.radians(first)).mean(axis=0)))
    found = robot.inverse(poses, near=middle)
    # the wrist that turns less far from its middle
    straight, over = found[:, branch], found[:, branch + 4]
    return straight if np.abs(straight[:, 3]).max() <= np.abs(over[:, 3]).max() else over


def at_tip(observations: Observations, tool: JointFit) -> Observations:
    """Observations of the tool's tip, by the tool alone."""
    if observations.rotations is None:
        return observations
    return replace(observations, positions=observations.positions + observations.rotations.apply(tool.values[0]))


def tool_alone(observations: Observations, reference: Array, inliers: NDArray[np.bool_]) -> JointFit:
    """Rigid part and tool: as the search for the tool finds them, or of all spots where it refuses the tool."""
    found = discover(observations, reference, inliers=inliers, effects=BARE, nested=False).fit
    if found.terms:
        return found
    return fit_jointly(observations, reference, terms_of(observations, BARE), np.ones(len(reference), dtype=np.bool_))


def searched(
    observations: Observations, reference: Array, inliers: NDArray[np.bool_], options: argparse.Namespace
) -> Search:
    """Look for all effects; with ``--tool-first`` of the tip that the tool alone shows."""
    bare = tool_alone(observations, reference, inliers)
    seen = at_tip(observations, bare) if options.tool_first else observations
    return Search(seen, bare, discover(seen, reference, inliers=inliers, noise=options.noise, nested=False))


def guess(fit: SpotFit, candidate: Candidate | None, options: argparse.Namespace) -> Guess:
    """Look for effects with a robot, or with the poses alone; and again without each fifth of the spots."""
    title = "poses alone, no robot"
    observations = Observations(fit.source, fit.source_rotations)
    if candidate is not None:
        title = candidate.names[0] if candidate.posture == POSTURES[0] else f"{candidate.names[0]}, {candidate.posture}"
        observations = replace(observations, joints=candidate.joints, robot=candidate.robot)
    inliers = fit.robust.inliers
    search = searched(observations, fit.reference, inliers, options)
    without = np.full((len(fit.ids), 2), np.nan)
    folds = folds_of(observations)["mixed"]
    for fold in range(int(folds.max()) + 1):
        rest, out = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        part = searched(observations.rows(rest), fit.reference[rest], inliers[rest], options)
        judged = observations.rows(out)
        without[out, 0] = errors(part.bare, judged, fit.reference[out])
        tip = at_tip(judged, part.bare) if options.tool_first else judged
        without[out, 1] = errors(part.found.fit, tip, fit.reference[out])
    return Guess(title, search.bare, search.found, complete(search, fit.reference), without)


def errors(fit: JointFit, observations: Observations, reference: Array) -> Array:
    """Distances (n,) of spots from where the model puts them [mm]."""
    places, _ = moved(observations, fit.terms, fit.values)
    apart = places @ fit.rotation.T + fit.translation - reference
    return np.asarray(np.linalg.norm(apart, axis=1), dtype=np.float64)


def complete(search: Search, reference: Array) -> JointFit:
    """Fit what was found with the tool beside it, where the tip was taken for known or the tool refused."""
    fit = search.found.fit
    if any(term.effect in BARE for term in fit.terms):
        return fit
    return fit_jointly(search.observations, reference, [*fit.terms, *search.bare.terms], fit.inliers)


def leave_one_out(fit: JointFit) -> float:
    """RMS of leave-one-out errors of all spots, of the structure that was found [mm]."""
    return rms(effects_model.left_out_of(fit))


def label(each: Accepted) -> str:
    """What was found, with the value of a single parameter, and what is not separated from it."""
    value = ""
    if len(each.values) == 1:
        value = f" {each.values[0]:.4g} +- {each.sd[0]:.2g} {each.term.parameters[0].unit}"
    rivals = ", ".join(term.label for term in each.not_separated)
    return f"{each.term.label}{value}{f' ~ {rivals}' if rivals else ''}{' NAMED' if each.named else ''}"


def show(one: Guess) -> None:
    """Print what was found with one robot, and whether a name stands on evidence that a rival equals."""
    found = one.found
    said = "; ".join(label(each) for each in found.accepted) or "nothing"
    out = int(np.count_nonzero(~found.fit.inliers))
    print(
        f"  {one.title:24} {leave_one_out(one.bare):7.3f} {leave_one_out(one.fit):7.3f} "
        f"{rms(one.without[:, :1]):8.3f} {rms(one.without[:, 1:]):7.3f} {out:4}  {said}",
        flush=True,
    )
    for each in found.accepted:
        if each.named and each.not_separated:
            print(f"    VIOLATION: {each.term.label} is named, {each.not_separated[0].label} is not separated")


def conclude(some: Sequence[Guess]) -> None:
    """Print what all robots agree on, and what depends on the guess."""
    found = [{each.term.label for each in one.found.accepted} - {"tool_offset frame tool"} for one in some]
    possible = [
        own | {term.label for each in one.found.accepted for term in each.not_separated}
        for own, one in zip(found, some, strict=True)
    ]
    every = sorted(set().union(*found))
    common = [name for name in every if all(name in names for names in found)]
    allowed = [name for name in sorted(set().union(*possible)) if all(name in names for names in possible)]
    others = [f"{name} ({sum(name in names for names in found)})" for name in every if name not in common]
    named = sum(each.named for one in some for each in one.found.accepted)
    better = sum(leave_one_out(one.fit) < leave_one_out(one.bare) for one in some)
    print(f"  {len(some)} robots; all find: {', '.join(common) or 'nothing in common'}")
    print(f"  found, or not separated from what is found, with all: {', '.join(allowed) or 'nothing'}")
    print(f"  depends on the robot (with how many): {', '.join(others) or 'nothing'}")
    held = sum(rms(one.without[:, 1:]) < rms(one.without[:, :1]) for one in some)
    print(f"  leave-one-out falls with {better} of {len(some)}, the error of spots chosen without with {held}")
    print(f"  named: {named}")


def main(folder: Path, options: argparse.Namespace) -> None:
    """Print the tables."""
    suffix = "_programmed.csv"
    every = sorted(path.name.removesuffix(suffix) for path in folder.glob(f"*{suffix}"))
    names = [name for name in every if not options.name or name in options.name]
    head = f"{'record':26} {'n':>3} {'in-sample':>9} {'leave-1':>9} {'worst':>9}   offset in the tool frame, 95 %"
    print("RMS and worst distance in mm\n" + head)
    fits = {name: fitted(folder, name) for name in names}
    for name, fit in fits.items():
        tools = tools_of(fit)
        print(row(name, fit_tool(fit.source, tools, fit.reference), tools))
        if fit.tool is not None and fit.tool.accepted and fit.tool.fit is not None and not fit.robust.inliers.all():
            print(row("  inliers of respot fit", fit.tool.fit, tools))
    for name, fit in fits.items():
        print(f"\n{name}: the worst spot deleted, again and again")
        deletions(fit, tools_of(fit))
    for name, fit in fits.items():
        print(f"\n{name}: effects; RMS in mm, {'of the tip' if options.tool_first else 'of the poses as given'}")
        print(f"  {'':24} leave-one-out   chosen without")
        print(f"  {'':24} {'before':>7} {'after':>7} {'before':>8} {'after':>7}  out  found")
        show(guess(fit, None, options))
        some = []
        for candidate in candidates(fit, MAKES.get(name.split("_")[0], ""), options.every_posture):
            some.append(guess(fit, candidate, options))
            show(some[-1])
            if len(candidate.names) > 1:
                print(f"    the same lengths: {', '.join(candidate.names[1:])}")
        if some:
            conclude(some)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--noise", type=float, help="noise per coordinate, known from elsewhere [mm]")
    parser.add_argument("--every-posture", action="store_true", help="also elbow down and reaching back")
    parser.add_argument("--tool-first", action="store_true", help="look for effects at the tip, not at the flange")
    parser.add_argument("--name", action="append", default=[], help="this record only; may be given again")
    chosen = parser.parse_args()
    main(chosen.folder, chosen)
