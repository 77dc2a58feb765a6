"""Where compensated programs land, on simulated lines whose truth the engine never sees: ``compensation_study.py``.

For each effect that a point can make good, and each seed: a line of spots is measured with noise, its programs are
compensated (`respot convert --measured`), and run through the simulator again. RMS distances after the best rigid
motion, without noise [mm]:

before   the uncompensated programs
after    programs compensated with what `--effects auto` found
oracle   programs compensated with a calibration that was told the effect's name and fitted to the same measurements
ratio    after / oracle, of the lines together (RMS over RMS); asked is 1.2

"kept": `respot validate` on a fresh measurement of the compensated programs says that the promise of the fit is kept.
Rows are printed again after every seed, so that a study that is stopped has told what it has seen.
"""

from __future__ import annotations

import argparse
import csv
import os
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from respot.calibration.prediction import UseOptions
from respot.calibration.source_fit import FitOptions
from respot.calibration.validation import validate_source
from respot.correction.conversion import convert, record_of
from respot.correction.options import CorrectionOptions
from respot.issues import BadInputError
from respot.output import write_backup
from respot.simulation import Line, files_of, rerun, simulate
from respot.simulation.line import rigid_rest, rms
from respot.spots import read_source

ROBOT, NOISE = "kr210_r2700_extra", 0.1
EFFECTS = (
    "joint_zero",
    "joint_profile",
    "gear",
    "link_length",
    "link_geometry",
    "gravity_sag",
    "tool_offset",
    "gun_sag",
    "gun_deflection",
    "backlash",
    "group_shift@station",
    "scale",
    "deformation",
    "rail",
)


@dataclass
class Tally:
    """What was seen of an effect."""

    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)
    oracle: list[float] = field(default_factory=list)
    kept: list[bool] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    def row(self, name: str) -> str:
        """One line of the table."""
        together = [float(np.sqrt(np.mean(np.square(some)))) for some in (self.before, self.after, self.oracle)]
        over = sum(after > 1.2 * oracle + 0.005 for after, oracle in zip(self.after, self.oracle, strict=True))
        return (
            f"{name:22}{len(self.after):6}{together[0]:9.3f}{together[1]:9.3f}{together[2]:9.3f}"
            f"{together[1] / together[2]:8.2f}{over:7}{sum(self.kept):7}{len(self.failed):8}"
        )


def told(line: Line, backup: Path) -> tuple[np.ndarray, object]:
    """Poses of the spots in the programs of a backup, in the order of the line."""
    spots = read_source(backup, line.ids).spots
    rows = [spots.ids.index(name) for name in line.ids]
    return spots.positions[rows], spots.rotations[rows]


def compensate(folder: Path, line: Line, effect: str, names: str | tuple[str, ...], out: Path) -> np.ndarray:
    """Compensate a line's programs and return where they land [mm]; the calibration goes beside them."""
    options = FitOptions(kind="measured", noise=NOISE, effects=names)
    made = convert(folder / "backup", folder / "measured.csv", None, options, CorrectionOptions())
    if made.correction.refused:
        raise BadInputError("REFUSED", made.correction.refused[0].message)
    write_backup(out, made.files, made.correction, record_of(made), force=False)
    made.calibration.save(out.parent / f"{out.name}.json")
    return rerun(line, (effect,), *told(line, out)).positions


def still_kept(folder: Path, line: Line, there: np.ndarray, out: Path, seed: int) -> bool:
    """Whether a fresh measurement of compensated programs keeps the promise of the fit."""
    noisy = there + np.random.default_rng(seed).normal(0.0, NOISE, there.shape)
    with (folder / "measured.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    place = {name: row for row, name in enumerate(line.ids)}
    for row in rows:
        row["x"], row["y"], row["z"] = (f"{value:.4f}" for value in noisy[place[row["id"]]])
    fresh = folder / "fresh.csv"
    with fresh.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    seen = validate_source(out, fresh, out.parent / f"{out.name}.json", "measured", UseOptions(any_robot=True))
    return seen.validation.promise.kept is not False


def run(effect: str, seed: int, spots: int, tally: Tally) -> None:
    """Close the loop once."""
    line = simulate(ROBOT, spots, NOISE, (effect,), seed, rail=effect == "rail")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, content in files_of(line).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        old = told(line, folder / "backup")
        try:
            oracle = compensate(folder, line, effect, (effect.partition("@")[0],), folder / "oracle")
            found = compensate(folder, line, effect, "auto", folder / "auto")
        except (BadInputError, ValueError) as error:
            tally.failed.append(f"{seed}: {error}")
            return
        tally.before.append(rms(rigid_rest(old[0], rerun(line, (effect,), *old).positions)))
        tally.after.append(rms(rigid_rest(old[0], found)))
        tally.oracle.append(rms(rigid_rest(old[0], oracle)))
        tally.kept.append(still_kept(folder, line, found, folder / "auto", seed))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Where compensated programs land.")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--spots", type=int, default=60)
    parser.add_argument("--effects", default=",".join(EFFECTS))
    chosen = parser.parse_args(arguments)
    tallies: dict[str, Tally] = defaultdict(Tally)
    for seed in range(chosen.first, chosen.first + chosen.seeds):
        for effect in chosen.effects.split(","):
            run(effect, seed, chosen.spots, tallies[effect])
        heads = ("effect", "lines", "before", "after", "oracle", "ratio", "> 1.2", "kept", "failed")
        print(f"\n{heads[0]:22}{heads[1]:>6}" + "".join(f"{head:>9}" for head in heads[2:5]), end="")
        print(f"{heads[5]:>8}{heads[6]:>7}{heads[7]:>7}{heads[8]:>8}")
        for effect, tally in tallies.items():
            if tally.after:
                print(tally.row(effect))
            for words in tally.failed:
                print(f"    {effect}: {words}")
        print(flush=True)


if __name__ == "__main__":
    main()
