"""Numbers and literals in all spellings that the languages allow: each is found, moved and brought back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.convert import laws
from tests.convert.known_transform import transform_about
from tests.convert.test_known_transform import respot, save_calibration
from tests.correction.small import SPOTS, krl, rapid

COUNT = 150


def spelled(value: float, rng: np.random.Generator, digits: int, gap: bool = False) -> str:
    """A number in one of the spellings of its language, with about so many digits behind the point."""
    decimals = int(rng.integers(max(digits - 2, 0), digits + 3))
    text = f"{value:.{decimals}f}"
    kind = rng.integers(0, 8)
    if kind == 0:
        text = f"{value:.{decimals}E}"
    elif kind == 1:
        text = f"{value:.{decimals}e}".replace("e+0", "e").replace("e-0", "e-")
    elif kind == 2 and abs(value) < 1.0 and decimals:
        text = text.replace("0.", ".", 1)
    elif kind == 3 and not decimals:
        text += "."
    elif kind == 4 and value > 0.0:
        text = "+" + text
    elif kind == 5 and gap and text.startswith("-"):
        text = "-  " + text[1:]
    return text


def krl_literal(rng: np.random.Generator) -> str:
    names = [*"XYZABC", *(f"E{n}" for n in range(1, int(rng.integers(1, 7))))]
    order = rng.permutation(names) if rng.random() < 0.3 else names
    values = {name: rng.uniform(-400.0, 400.0) for name in "XYZ"}
    values |= {"A": rng.uniform(-180.0, 180.0), "B": rng.uniform(-40.0, 40.0), "C": rng.uniform(-180.0, 180.0)}
    blanks = [" " * int(rng.integers(1, 4)) for _ in order]
    members = [
        (name.lower() if rng.random() < 0.1 else name)
        + blank
        + spelled(values.get(name, rng.uniform(-900.0, 900.0)), rng, 4 if name in "ABC" else 3)
        for name, blank in zip(order, blanks, strict=True)
    ]
    typed = "E6POS: " if rng.random() < 0.2 else ""
    return "{" + typed + ("," if rng.random() < 0.8 else " , ").join(members) + "}"


def rapid_literal(rng: np.random.Generator) -> str:
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    place = [spelled(value, rng, 2, gap=True) for value in rng.uniform(-400.0, 400.0, 3)]
    turn = [spelled(value, rng, 7, gap=True) for value in quaternion]
    unused = rng.choice(["9E9", "9E+09", "9E+9", "9.0000E+09", "1E+10", "9000000000"])
    external = [unused if rng.random() < 0.8 else spelled(rng.uniform(0.0, 200.0), rng, 3) for _ in range(6)]
    comma = rng.choice([",", ", ", ",\n      ", " ,"], p=[0.7, 0.1, 0.1, 0.1])
    groups = [place, turn, ["0", "-1", "1", "0"], external]
    return "[" + comma.join("[" + comma.join(group) + "]" for group in groups) + "]"


def krl_backup(rng: np.random.Generator) -> dict[str, str]:
    declared = "".join(f"DECL E6POS XP{n}={krl_literal(rng)}\n" for n in range(COUNT))
    ways = "".join(f"LIN XP{n}\n" for n in range(COUNT)) + "".join(f"PTP {krl_literal(rng)}\n" for _ in range(COUNT))
    return krl("FDAT_ACT=FS1\nBAS(#CP_PARAMS,1)\n" + ways, declared)


def rapid_backup(rng: np.random.Generator) -> dict[str, str]:
    behind = ",v100,z10,tGun\\WObj:=wDoor;\n"
    declared = "".join(f"  CONST robtarget p{n}:={rapid_literal(rng)};\n" for n in range(COUNT))
    ways = "".join(f"    MoveL p{n}{behind}" for n in range(COUNT))
    ways += "".join(f"    MoveJ {rapid_literal(rng)}{behind}" for _ in range(COUNT))
    for _ in range(COUNT):
        way = [spelled(value, rng, 1, gap=True) for value in rng.uniform(-90.0, 90.0, 3)]
        ways += f"    MoveL Offs(S1, {' ,'.join(way)} ){behind}"
    return rapid(ways, declared)


@pytest.mark.parametrize(("make", "offsets"), [(krl_backup, 0), (rapid_backup, COUNT)])
def test_every_spelling_is_found_moved_and_brought_back(tmp_path: Path, make, offsets):
    for path, text in make(np.random.default_rng(11)).items():
        (tmp_path / "in" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / path).write_bytes(text.replace("\n", "\r\n").encode("ascii"))
    transform = transform_about(np.array([1100.0, 250.0, 600.0]))
    save_calibration(tmp_path / "cal.json", transform, tuple(SPOTS))
    there = ("-c", tmp_path / "cal.json", "--keep-config", "--json")
    code, record, err = respot("convert", tmp_path / "in", *there, "-o", tmp_path / "out")
    assert code == 0, err
    old = laws.files_of(tmp_path / "in")
    found = laws.judge(old, laws.files_of(tmp_path / "out"), transform, record)
    assert not found.wrong
    assert (found.moved, found.offsets, found.unseen) == (2 * COUNT + len(SPOTS), offsets, [])
    assert respot("convert", tmp_path / "out", *there, "--inverse", "-o", tmp_path / "back")[0] == 0
    assert not laws.judge_back(old, laws.files_of(tmp_path / "back"), record["edits"]).wrong
