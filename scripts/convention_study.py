"""How often a wrong convention of orientations is found, and how often one is claimed that is not there.

Usage: ``python scripts/convention_study.py [--tables 1000] [--each 60] [--only NAME]``, one of alarms, found, tool

Alarms: correct tables of 8 to 120 spots, with orientations spread by 5 to 60 degrees (per axis), noise of 0.1 to 1
degree (per axis), up to a tenth of wrong spots, with and without a constant turn of the tool frame, with a registration
and without: anything found is false. Beside them tables whose orientations have nothing to do with each other.

Found: one list is written in every wrong way, orientations spread by 15 to 60 degrees. Printed is the share with the
right reading first, or among those that the spots do not tell apart; named; with the right list, or said not to be
known. What is missed is printed as spots/spread/noise.

Tool: the reference has positions only, and the tool is 50 to 800 mm off; the same, judged by the fit of an offset.

The simulator shares no code with the package.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects.convention import investigate_convention
from respot.calibration.effects.convention_tool import investigate_by_tool

Array = NDArray[np.float64]


def _as(order: str, degrees: bool = True) -> Callable[[Rotation], Rotation]:
    return lambda rotations: _written(rotations.as_euler(order, degrees=degrees))


def _written(angles: Array) -> Rotation:
    """What is read where these numbers stand in the columns A, B, C."""
    return Rotation.from_euler("ZYX", angles, degrees=True)


def _signs(*signs: float) -> Callable[[Rotation], Rotation]:
    return lambda rotations: _written(rotations.as_euler("ZYX", degrees=True) * signs)


def _quaternion(inverse: bool, last: bool) -> Callable[[Rotation], Rotation]:
    def write(rotations: Rotation) -> Rotation:
        turned = rotations.inv() if inverse else rotations
        return Rotation.from_quat(turned.as_quat(scalar_first=not last), scalar_first=True)

    return write


WRITTEN: dict[str, tuple[str, Callable[[Rotation], Rotation]]] = {
    "inverse": ("abc", lambda rotations: rotations.inv()),
    "xyz_fixed": ("abc", _as("xyz")),
    "xyz_moving": ("abc", _as("XYZ")),
    "zyx_fixed": ("abc", _as("zyx")),
    "zyz_moving": ("abc", _as("ZYZ")),
    "zxz_moving": ("abc", _as("ZXZ")),
    "zyx_radians": ("abc", _as("ZYX", False)),
    "xyz_fixed_radians": ("abc", _as("xyz", False)),
    "xyz_moving_radians": ("abc", _as("XYZ", False)),
    "zyz_moving_radians": ("abc", _as("ZYZ", False)),
    "sign_a": ("abc", _signs(-1, 1, 1)),
    "sign_b": ("abc", _signs(1, -1, 1)),
    "sign_c": ("abc", _signs(1, 1, -1)),
    "sign_abc": ("abc", _signs(-1, -1, -1)),
    "vector_xyz_radians": ("abc", lambda rotations: _written(rotations.as_rotvec())),
    "vector_zyx": ("abc", lambda rotations: _written(rotations.as_rotvec(degrees=True)[:, ::-1])),
    "columns_ab": ("abc", lambda rotations: _written(rotations.as_euler("ZYX", degrees=True)[:, [1, 0, 2]])),
    "columns_bc": ("abc", lambda rotations: _written(rotations.as_euler("ZYX", degrees=True)[:, [0, 2, 1]])),
    "scalar_last": ("quaternion", _quaternion(False, True)),
    "scalar_last_inverse": ("quaternion", _quaternion(True, True)),
    "conjugate": ("quaternion", _quaternion(True, False)),
}
SAME_KEY = {"conjugate": "inverse"}
HIDDEN = "scalar_last_inverse"
"""Two constant turns are the same as this one: without a registration there is nothing to see."""


class Table:
    """A made-up table: orientations of both lists, positions, and the transform between them."""

    def __init__(self, dice: np.random.Generator, spread: float, families: bool | None = None) -> None:
        self.n = int(dice.integers(8, 121))
        self.noise = float(np.exp(dice.uniform(np.log(0.1), np.log(1.0))))
        middle = Rotation.random(random_state=dice)
        turns = Rotation.from_rotvec(dice.normal(size=(self.n, 3)) * spread, degrees=True)
        if dice.random() < 0.3 if families is None else families:
            family = dice.integers(int(dice.integers(5, 9)), size=self.n)
            turns = turns[family] * Rotation.from_rotvec(dice.normal(size=(self.n, 3)), degrees=True)
        self.source = middle * turns
        self.registration = Rotation.random(random_state=dice) if dice.random() < 0.5 else Rotation.identity()
        self.turn = Rotation.random(random_state=dice) if dice.random() < 0.5 else Rotation.identity()
        blur = Rotation.from_rotvec(dice.normal(size=(self.n, 3)) * self.noise, degrees=True)
        self.reference = self.registration * self.source * self.turn * blur
        self.wrong = dice.permutation(self.n)[: int(dice.integers(self.n // 10 + 1))]
        if len(self.wrong):
            other = self.reference.as_quat()
            other[self.wrong] = Rotation.random(len(self.wrong), random_state=dice).as_quat()
            self.reference = Rotation.from_quat(other)
        off = Rotation.from_rotvec(dice.normal(size=3) * 0.03, degrees=True)
        self.known = (off * self.registration).as_matrix()


def alarms(tables: int) -> None:
    """Print how many correct tables are said to be wrong."""
    for registered in (True, False):
        for related in (True, False):
            claimed: Counter[str] = Counter()
            for number in range(tables):
                dice = np.random.default_rng((number, 1, registered, related))
                table = Table(dice, float(dice.uniform(5.0, 60.0)))
                reference = table.reference if related else Rotation.random(table.n, random_state=dice)
                columns = "abc" if dice.random() < 0.6 else "quaternion"
                found = investigate_convention(
                    table.source,
                    reference,
                    registration=table.known if registered else None,
                    kind="measured",
                    source_columns=columns,
                    reference_columns=columns,
                ).finding
                if found is not None:
                    claimed[f"{found.side}: {found.reading}"] += 1
            print(
                f"{'registered' if registered else 'joint':10} {'correct' if related else 'unrelated':10} "
                f"{sum(claimed.values()):5} of {tables}  {dict(claimed)}",
                flush=True,
            )


def found(each: int) -> None:
    """Print how often every wrong convention is found."""
    print(
        f"{'':10} {'written':22}{'side':10}{'tables':>7}{'right':>8}{'or tied':>9}{'named':>8}{'list':>8}  missed at n"
    )
    for registered in (True, False):
        totals: list[tuple[bool, bool]] = []
        for key, (columns, write) in WRITTEN.items():
            if not registered and key == HIDDEN:
                continue
            for side in ("source", "reference"):
                rows, missed = _found(each, key, columns, write, side, registered)
                totals += [(right, alike) for right, alike, _, _ in rows]
                shares = np.mean(np.array(rows, dtype=float), axis=0)
                print(
                    f"{'registered' if registered else 'joint':10} {key:22}{side:10}{each:7}{shares[0]:8.1%}"
                    f"{shares[1]:9.1%}{shares[2]:8.1%}{shares[3]:8.1%}  {missed}",
                    flush=True,
                )
        print(f"in all: right {np.mean([x for x, _ in totals]):.2%}, or tied {np.mean([x for _, x in totals]):.2%}")


def _found(
    each: int, key: str, columns: str, write: Callable[[Rotation], Rotation], side: str, registered: bool
) -> tuple[list[tuple[bool, bool, bool, bool]], list[str]]:
    rows: list[tuple[bool, bool, bool, bool]] = []
    missed: list[str] = []
    for number in range(each):
        dice = np.random.default_rng((number, 2, registered, list(WRITTEN).index(key), side == "source"))
        spread = float(dice.uniform(15.0, 60.0))
        table = Table(dice, spread)
        lists = {"source": table.source, "reference": table.reference}
        lists[side] = write(lists[side])
        trial = investigate_convention(
            lists["source"],
            lists["reference"],
            registration=table.known if registered else None,
            kind="measured",
            source_columns=columns,
            reference_columns=columns,
        )
        finding = trial.finding
        if finding is None:
            missed.append(f"{table.n}/{spread:.0f}/{table.noise:.1f}")
            rows.append((False, False, False, False))
            continue
        right = finding.reading == SAME_KEY.get(key, key)
        alike = right or f"{side}: {SAME_KEY.get(key, key)}" in finding.tied
        if not alike:
            missed.append(f"{table.n}/{spread:.0f}/{table.noise:.1f}:{finding.side}:{finding.reading}")
        rows.append((right, alike, finding.effect.named, finding.side == side or not finding.side_known))
    return rows, missed


def tool(tables: int, each: int) -> None:
    """Print the same where the reference has positions only."""
    claimed: Counter[str] = Counter()
    for number in range(tables):
        dice = np.random.default_rng((number, 3))
        table = Table(dice, float(dice.uniform(5.0, 60.0)))
        finding = investigate_by_tool(*_positions(dice, table), seed=0, kind="measured").finding
        if finding is not None:
            claimed[finding.reading] += 1
    print(f"correct: {sum(claimed.values())} of {tables} {dict(claimed)}", flush=True)
    for key, (columns, write) in WRITTEN.items():
        if columns != "abc":
            continue
        right, other = 0, Counter[str]()
        for number in range(each):
            dice = np.random.default_rng((number, 4, list(WRITTEN).index(key)))
            table = Table(dice, float(dice.uniform(15.0, 60.0)))
            source, rotations, reference = _positions(dice, table, offset=True)
            trial = investigate_by_tool(source, write(rotations), reference, seed=0, kind="measured")
            if trial.finding is not None and trial.finding.reading == key:
                right += 1
            elif trial.finding is None:
                other[f"{table.n}: {trial.verdict}"] += 1
            else:
                other[f"{table.n}: {trial.finding.reading}"] += 1
        print(f"{key:22}{right / each:8.1%}  {dict(other)}", flush=True)


def _positions(dice: np.random.Generator, table: Table, offset: bool = False) -> tuple[Array, Rotation, Array]:
    """Source positions, their true orientations, and what is measured: with an offset, other causes, wrong spots."""
    source = dice.uniform(-0.5, 0.5, (table.n, 3)) * [1600.0, 800.0, 1200.0]
    length = dice.uniform(50.0, 800.0) if offset or dice.random() < 0.6 else 0.0
    way = dice.normal(size=3)
    moved = source + table.source.apply(way / np.linalg.norm(way) * length)
    if not offset:
        kind = dice.integers(4)
        if kind == 1:  # groups in space that stand off
            moved[: table.n // 3] += dice.normal(size=3) * 3.0
        elif kind == 2:  # growth of the part
            moved *= 1.0 + dice.normal(size=3) * 0.002
        elif kind == 3:  # the gun sags under gravity, by its orientation
            moved += table.source.apply([1.0, 0.0, 0.0])[:, 2:] * dice.normal(size=3) * 2.0
    measured = table.registration.apply(moved) + dice.normal(size=3) * 1000.0
    measured += dice.normal(size=measured.shape) * float(np.exp(dice.uniform(np.log(0.05), np.log(1.0))))
    measured[table.wrong] += dice.normal(size=(len(table.wrong), 3)) * 20.0
    return source, table.source, measured


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tables", type=int, default=1000)
    parser.add_argument("--each", type=int, default=60)
    parser.add_argument("--only", choices=["alarms", "found", "tool"])
    asked = parser.parse_args()
    if asked.only in (None, "alarms"):
        alarms(asked.tables)
    if asked.only in (None, "found"):
        found(asked.each)
    if asked.only in (None, "tool"):
        tool(asked.tables, asked.each)


if __name__ == "__main__":
    main()
