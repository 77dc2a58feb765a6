"""Spots that lie where another listed tool or base would put them; the truth is worked out by scipy in `framed`."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.calibration.effects.moved import moved, unmoved
from respot.calibration.effects.wrong_frame import Exchange
from respot.calibration.effects.wrong_frame_search import find_wrong_frames
from respot.calibration.observations import Observations
from respot.calibration.spot_frames import ListedFrame, SpotFrames
from respot.cli import app
from respot.spots import read_source
from tests.discovery.framed import BASES, TOOLS, Cell, Group, pose

EFFECTS = "swapped_ids,group_shift,wrong_frame"
HERE = (0.0,) * 6


@dataclass(frozen=True)
class Fitted:
    folder: Path
    code: int
    out: str
    err: str

    @property
    def record(self) -> dict:
        return json.loads(self.out)

    @property
    def wrong(self) -> list[dict]:
        return [effect for effect in self.record["effects"] if effect["name"] == "wrong_frame"]

    @property
    def names(self) -> list[str]:
        return [effect["name"] for effect in self.record["effects"]]


def run(*arguments: object) -> Fitted:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return Fitted(Path(), result.exit_code, result.stdout, result.stderr)


def fit(cell: Cell, folder: Path, *options: object, kind="--measured", language="krl", users=None) -> Fitted:
    if language == "krl":
        cell.write_krl(folder / "backup")
    else:
        cell.write_rapid(folder / "backup", users)
    cell.write_reference(folder / "reference.csv")
    found = run("fit", folder / "backup", kind, folder / "reference.csv", "--effects", EFFECTS, "--json", *options)
    return replace(found, folder=folder)


def three(**wrong) -> dict[str, Group]:
    """Three programs under bases of their own; the third is wrong."""
    return {"weld_a": Group(base=1), "weld_b": Group(base=2), "weld_c": Group(**{"base": 3, **wrong})}


NAMES = {
    "krl": {"base": "BASE_DATA[{}]", "tool": "TOOL_DATA[{}]", "world": "$WORLD", "flange": "$NULLFRAME"},
    "rapid": {"base": "wFix{}", "tool": "tGun{}", "world": "wobj0", "flange": "tool0"},
}


@pytest.mark.parametrize("language", ["krl", "rapid"])
@pytest.mark.parametrize(
    ("wrong", "kind", "written", "real"),
    [
        ({"real_base": 4}, "base", 3, 4),
        ({"real_base": 6}, "base", 3, 6),
        ({"real_base": 0}, "base", 3, 0),
        ({"real_tool": 3}, "tool", 1, 3),
        ({"real_tool": 2}, "tool", 1, 2),
        ({"base": 0, "real_base": 2}, "base", 0, 2),
    ],
)
def test_the_frame_is_named(tmp_path, language, wrong, kind, written, real):
    found = fit(Cell(three(**wrong)), tmp_path, language=language)
    assert found.code == 0, found.err
    (effect,) = found.record["effects"]
    names = NAMES[language]
    said = [names[kind].format(number) if number else names["world"] for number in (written, real)]
    assert effect["where"] == {
        "column": "program",
        "level": "weld_c",
        "frame": kind,
        "written": said[0],
        "real": said[1],
    }
    assert effect["named"] is True
    assert effect["not_separated_from"] == []
    assert effect["remedy"]["where"] == kind
    assert effect["p_value"] < 1e-3
    assert found.record["noise_floor"] is None
    assert found.record["after"]["rms"] < 0.2  # 0.1 mm along each axis
    assert found.record["n_inliers"] == 42


def test_the_shift_is_that_of_the_frames(tmp_path):
    found = fit(Cell(three(real_base=4)), tmp_path)
    (effect,) = found.wrong
    for axis, listed in zip("xyz", (25.1, -3.2, 0.4), strict=True):
        low, high = effect["parameters"][axis]["ci95"]
        assert low - 0.05 < listed < high + 0.05
        assert high - low < 0.4
    assert effect["evidence"]["listed_shift"] == pytest.approx([25.1, -3.2, 0.4], abs=1e-3)
    assert "not BASE_DATA[3] that is written: a shift of +25.10 -3.20 +0.40 mm" in effect["remedy"]["text"]


@pytest.mark.parametrize("language", ["krl", "rapid"])
def test_nothing_there_is_nothing_found(tmp_path, language):
    found = fit(Cell(three()), tmp_path, language=language)
    assert found.code == 0
    assert found.record["effects"] == []


def test_a_shift_that_no_frame_makes_stays_a_moved_group(tmp_path):
    found = fit(Cell(three(shift=(4.0, -2.0, 1.0))), tmp_path)
    assert found.names == ["group_shift"]
    assert found.record["effects"][0]["not_separated_from"] == []


def test_a_frame_that_is_nearly_the_shift_is_not_taken_for_it(tmp_path):
    near = (BASES[3][0] + 1.5, BASES[3][1], BASES[3][2] - 2.0, *BASES[3][3:])
    found = fit(Cell(three(shift=(1.5, 0.6, -1.6)), bases={**BASES, 7: near}), tmp_path)
    assert found.names == ["group_shift"]


@pytest.mark.parametrize(("apart", "named"), [(0.0, False), (0.1, False), (3.0, True)])
def test_frames_that_are_alike_are_not_separated(tmp_path, apart, named):
    twin = (BASES[6][0] + apart, *BASES[6][1:])
    found = fit(Cell(three(real_base=6), bases={**BASES, 9: twin}), tmp_path)
    (effect,) = found.wrong
    assert effect["named"] is named
    assert any("real BASE_DATA[9]" in name for name in effect["not_separated_from"]) is not named
    assert ("BASE_DATA[9] would put them there as well" in effect["remedy"]["text"]) is not named


def test_frames_that_were_never_set_are_the_world_itself(tmp_path):
    found = fit(Cell(three(real_base=0)), tmp_path)  # BASE_DATA[7] and others are zeros
    assert found.wrong[0]["where"]["real"] == "$WORLD"
    assert found.wrong[0]["named"]


@pytest.mark.parametrize(("kind", "deviation", "named"), [("--measured", HERE, False), ("--theory", HERE, True)])
def test_two_groups_against_each_other(tmp_path, kind, deviation, named):
    """Either group may be wrong, one frame for the other; in one coordinate system the rest of the cell tells which."""
    cell = Cell({"weld_a": Group(base=1), "weld_c": Group(base=3, real_base=1)}, registration=deviation)
    (effect,) = fit(cell, tmp_path, kind=kind).wrong
    assert effect["named"] is named
    if named:
        assert effect["where"]["level"] == "weld_c"
    else:
        assert len(effect["not_separated_from"]) == 1


def test_of_two_groups_one_alone_has_such_a_frame(tmp_path):
    (effect,) = fit(Cell({"weld_a": Group(base=1), "weld_c": Group(base=3, real_base=4)}), tmp_path).wrong
    assert effect["named"]
    assert effect["where"]["level"] == "weld_c"


def test_all_spots_under_a_wrong_base(tmp_path):
    """A free frame swallows it; where theory is in the same frame it shows."""
    cell = {"weld_a": Group(base=3, real_base=6, spots=20)}
    (tmp_path / "free").mkdir()
    assert fit(Cell(cell), tmp_path / "free").record["effects"] == []
    (tmp_path / "same").mkdir()
    (effect,) = fit(Cell(cell, registration=HERE), tmp_path / "same", kind="--theory").wrong
    assert effect["named"]
    assert (effect["where"]["written"], effect["where"]["real"]) == ("BASE_DATA[3]", "BASE_DATA[6]")


def test_all_spots_under_a_wrong_tool(tmp_path):
    (effect,) = fit(Cell({"weld_a": Group(base=3, real_tool=3, spots=20)}), tmp_path).wrong
    assert effect["named"]
    assert (effect["where"]["frame"], effect["where"]["real"]) == ("tool", "TOOL_DATA[3]")
    lengths = np.subtract([118.0, 0.0, 575.0], [120.0, 0.0, 540.0])
    there = Rotation.from_euler("ZYX", [0.0, 90.0, 0.0], degrees=True).inv().apply(lengths)
    assert effect["evidence"]["listed_shift"] == pytest.approx(there, abs=1e-3)


def test_two_groups_are_wrong(tmp_path):
    groups = {
        "weld_a": Group(base=1),
        "weld_b": Group(base=2, real_base=6),
        "weld_c": Group(base=3, real_base=4),
        "weld_d": Group(base=1),
    }
    found = fit(Cell(groups), tmp_path)
    assert {(each["where"]["level"], each["where"]["real"], each["named"]) for each in found.wrong} == {
        ("weld_b", "BASE_DATA[6]", True),
        ("weld_c", "BASE_DATA[4]", True),
    }
    assert found.record["after"]["rms"] < 0.2


def test_most_spots_are_wrong(tmp_path):
    groups = {"weld_a": Group(spots=8), "weld_b": Group(base=2, spots=8), "weld_c": Group(30, base=3, real_base=6)}
    (effect,) = fit(Cell(groups), tmp_path).wrong
    assert effect["named"]
    assert effect["where"]["level"] == "weld_c"


def test_a_wide_interval_proves_nothing(tmp_path):
    """The listed frame fits, and so would many: the group is said to be off, and not why."""
    found = fit(Cell(three(real_base=4), noise=1.5), tmp_path, "--noise", "1.5")
    (effect,) = found.record["effects"]
    assert effect["name"] == "group_shift"
    assert not effect["named"]
    assert any("real BASE_DATA[4]" in name for name in effect["not_separated_from"])


def test_exchanged_names_beside(tmp_path):
    found = fit(Cell(three(real_base=6), swapped=(("S302", "S307"),)), tmp_path)
    assert found.names == ["swapped_ids", "wrong_frame"]
    assert set(found.record["effects"][0]["where"]["ids"]) == {"S302", "S307"}
    assert found.wrong[0]["named"]


@pytest.mark.parametrize("part", ["uframe", "oframe"])
def test_a_user_or_object_frame_alone(tmp_path, part):
    users = {1: (1000.0, 0.0, 400.0, 5.0, 0.0, 0.0), 2: HERE, 3: (1100.0, 500.0, 400.0, -4.0, 0.0, 0.0), 4: HERE}
    users[6] = (1450.0, 100.0, 600.0, 20.0, 0.0, 0.0)
    objects = {number: pose(users[number]).inv() * pose(BASES[number]) for number in BASES}
    real = pose(users[6]) * objects[3] if part == "uframe" else pose(users[3]) * objects[6]
    found = fit(Cell(three(real_pose=real)), tmp_path, language="rapid", users=users)
    (effect,) = found.wrong
    assert effect["where"] == {
        "column": "program",
        "level": "weld_c",
        "frame": part,
        "written": "wFix3",
        "real": "wFix6",
    }
    assert effect["named"]


def test_a_program_with_two_bases(tmp_path):
    """Only the spots of the program that name the base are meant."""
    cell = Cell({"weld_a": Group(base=1), "weld_b": Group(base=3), "weld_c": Group(base=3, real_base=6)})
    (effect,) = fit(cell, tmp_path).wrong
    assert effect["where"]["level"] == "weld_c"
    assert effect["evidence"]["spots"] == 14


# ------------------------------------------------------------------------------------------------ calibrations and text


def test_a_calibration_is_kept_and_predicts(tmp_path):
    cell = Cell(three(real_base=6))
    found = fit(cell, tmp_path, "-o", tmp_path / "cal.json")
    assert found.code == 0, found.err
    backup, reference = tmp_path / "backup", tmp_path / "reference.csv"
    predicted = run("predict", backup, "-c", tmp_path / "cal.json", "--json")
    assert predicted.code == 0, predicted.err
    with reference.open(encoding="utf-8", newline="") as file:
        there = {row["id"]: [float(row[axis]) for axis in "xyz"] for row in csv.DictReader(file)}
    apart = [
        np.linalg.norm(np.subtract([spot[axis] for axis in "xyz"], there[spot["id"]]))
        for spot in predicted.record["spots"]
    ]
    assert max(apart) < 0.5
    narrow = max(spot["ci95"] for spot in predicted.record["spots"])
    kept = run("validate", backup, "--measured", reference, "-c", tmp_path / "cal.json", "--json")
    assert kept.record["kept"] is True
    # a list tells no bases: what is not known is said, and the interval is as wide
    spots = read_source(backup).spots
    with (tmp_path / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "x", "y", "z"])
        writer.writerows([name, *place] for name, place in zip(spots.ids, spots.positions, strict=True))
    blind = run("predict", tmp_path / "poses.csv", "-c", tmp_path / "cal.json", "--json")
    assert "EFFECT_LEFT_OUT" in [issue["code"] for issue in blind.record["issues"]]
    assert max(spot["ci95"] for spot in blind.record["spots"]) > 100.0 > 1.0 > narrow


def test_a_program_that_was_corrected_is_not_moved_again(tmp_path):
    cell = Cell(three(real_base=6))
    assert fit(cell, tmp_path, "-o", tmp_path / "cal.json").code == 0
    data = tmp_path / "backup" / "KRC" / "R1" / "Program" / "weld_c.dat"
    data.write_bytes(data.read_bytes().replace(b"BASE_NO 3", b"BASE_NO 6"))
    checked = run(
        "validate", tmp_path / "backup", "--measured", tmp_path / "reference.csv", "-c", tmp_path / "cal.json", "--json"
    )
    assert checked.record["rms"] < 0.2


def test_programs_are_not_corrected_by_it(tmp_path):
    assert fit(Cell(three(real_base=6)), tmp_path, "-o", tmp_path / "cal.json").code == 0
    refused = run("convert", tmp_path / "backup", "-c", tmp_path / "cal.json", "-o", tmp_path / "out")
    assert refused.code == 2
    assert "WRONG_FRAME" in refused.err


def test_what_the_terminal_and_the_page_say(tmp_path):
    cell = Cell(three(real_base=4))
    fit(cell, tmp_path)
    arguments = ["fit", tmp_path / "backup", "--measured", tmp_path / "reference.csv", "--effects", EFFECTS]
    said = run(*arguments, "--report", tmp_path / "page.html")
    assert said.code == 0, said.err
    assert "wrong_frame program weld_c, BASE_DATA[4] in the place of BASE_DATA[3] (named): The spots of" in said.out
    assert "The spots of program weld_c lie where BASE_DATA[4] would put them, not BASE_DATA[3]." in said.out
    assert "Correct the base or work object." in said.out
    page = re.sub(r"\s+", " ", (tmp_path / "page.html").read_text(encoding="utf-8"))
    assert "The spots of program weld_c lie where BASE_DATA[4] would put them, not BASE_DATA[3]" in page


def test_it_may_be_left_out(tmp_path):
    cell = Cell(three(real_base=4))
    fit(cell, tmp_path)
    found = run(
        "fit", tmp_path / "backup", "--measured", tmp_path / "reference.csv", "--effects", "group_shift", "--json"
    )
    assert found.names == ["group_shift"]


def test_a_list_has_no_frames(tmp_path):
    cell = Cell(three(real_base=4))
    with (tmp_path / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "x", "y", "z", "base"])
        for name, place, group in cell.places:
            writer.writerow([name, *np.asarray(place.translation).tolist(), group.base])
    cell.write_reference(tmp_path / "reference.csv")
    found = run("fit", tmp_path / "poses.csv", "--measured", tmp_path / "reference.csv", "--effects", EFFECTS, "--json")
    assert found.code == 0
    assert found.names == ["group_shift"]


# ------------------------------------------------------------------------------------------------------- beside others


def test_beside_an_error_of_the_arm(tmp_path):
    """A mastering error hides 3 mm between two bases until it is in the model; its own value is that of the arm."""
    made = run(
        "simulate", tmp_path / "line", "--spots", 60, "--seed", 5, "--noise", 0.1, "--effect", "joint_zero@3:1.5"
    )
    assert made.code == 0
    backup, measured = tmp_path / "line" / "backup", tmp_path / "line" / "measured.csv"
    names = "swapped_ids,joint_zero,group_shift,wrong_frame"
    arguments = ["fit", backup, "--measured", measured, "--noise", 0.1, "--effects", names, "--json"]
    plain = run(*arguments).record["effects"]
    (config,) = backup.rglob("$config.dat")
    text = config.read_bytes().decode("cp1252")
    first = re.search(r"BASE_DATA\[1\]=\{X ([-\d.]+),Y ([-\d.]+),Z ([-\d.]+),(.*?)\}", text)
    assert first is not None
    x, y, z = (float(first[number]) for number in (1, 2, 3))
    second = f"BASE_DATA[2]={{X {x + 3.0:.3f},Y {y - 1.5:.3f},Z {z + 1.0:.3f},{first[4]}}}"
    config.write_bytes(re.sub(r"BASE_DATA\[2\]=\{.*?\}", second, text).encode("cp1252"))
    (program,) = backup.rglob("roof_*.dat")
    program.write_bytes(program.read_bytes().replace(b"BASE_NO 1", b"BASE_NO 2"))
    found = run(*arguments)
    assert sorted(found.names) == ["joint_zero", "wrong_frame"]
    (effect,) = found.wrong
    assert effect["where"]["column"] == "program"
    assert (effect["where"]["written"], effect["where"]["real"]) == ("BASE_DATA[2]", "BASE_DATA[1]")
    assert len(effect["not_separated_from"]) == 1  # all others under base 2 in the place of base 1
    zero = next(each for each in found.record["effects"] if each["name"] == "joint_zero")
    assert zero["named"]
    assert zero["parameters"]["offset"]["value"] == pytest.approx(plain[0]["parameters"]["offset"]["value"], abs=1e-4)


# ------------------------------------------------------------------------------------------------------------- the term


def spots_of(n: int = 12) -> Observations:
    dice = np.random.default_rng(2)
    listed = {
        kind: {f"F{number}": ListedFrame(f"F{number}", "", pose(numbers)) for number, numbers in frames.items()}
        for kind, frames in (("base", BASES), ("tool", TOOLS))
    }
    frames = SpotFrames(("a",) * 6 + ("b",) * 6, ("F1",) * n, ("F1",) * 6 + ("F3",) * 6, listed)
    points = dice.uniform(-400.0, 400.0, (n, 3)) + [1500.0, 0.0, 700.0]
    turns = Rotation.from_euler("ZYX", dice.uniform(-90.0, 90.0, (n, 3)), degrees=True)
    return Observations(points, turns, frames=frames)


def terms_of(seen: Observations):
    listed = seen.frames.listed
    base, tool = listed["base"], listed["tool"]
    motion = base["F6"].pose * base["F3"].pose.inv()
    length = tool["F1"].pose.inv() * tool["F2"].pose
    place = {"column": "program", "level": "b"}
    return (
        Exchange("base", base["F3"], base["F6"], motion).term(place),
        Exchange("tool", tool["F1"], tool["F2"], length).term({}),
    )


def test_the_term_is_exact_and_turns_back():
    seen = spots_of()
    terms, values = terms_of(seen), (np.zeros(0),) * 2
    places, turns = moved(seen, terms, values)
    own = RigidTransform.from_components(seen.positions, seen.rotations)
    there = [pose(BASES[6]) * pose(BASES[3]).inv() * own[row] if row >= 6 else own[row] for row in range(12)]
    there = [each * pose(TOOLS[1]).inv() * pose(TOOLS[2]) for each in there]
    assert places == pytest.approx(np.array([each.translation for each in there]), abs=1e-9)
    wanted = Rotation.concatenate([each.rotation for each in there])
    assert np.degrees((wanted.inv() * turns).magnitude()).max() < 1e-9
    assert unmoved(seen, terms, values, places) == pytest.approx(seen.positions, abs=1e-8)


def test_a_calibration_with_it_is_read_as_it_was_written():
    seen = spots_of()
    terms, values = terms_of(seen), (np.zeros(0),) * 2
    made = Calibration(np.eye(3), np.array([1.0, 2.0, 3.0]), "measured", "free", terms=terms, values=values)
    read = Calibration.from_json(made.to_json())
    first, second = (each.predict(seen.positions, seen.rotations, seen)[0] for each in (made, read))
    assert np.array_equal(first, second)
    assert read.content_hash == made.content_hash
    back = read.unpredict(first, seen.rotations, seen)
    assert back == pytest.approx(seen.positions, abs=1e-8)


@pytest.mark.parametrize("seed", range(12))
def test_chance_is_named_by_nobody(seed):
    """A group that moved by anything, beside twenty listed bases, half of them near its own."""
    dice = np.random.default_rng(seed)
    own = {number: pose([*dice.uniform(-800.0, 800.0, 3), *dice.uniform(-30.0, 30.0, 3)]) for number in (1, 2, 3)}
    near = {
        number: RigidTransform.from_translation(dice.normal(0.0, 10.0 ** dice.uniform(-0.5, 1.2), 3)) * own[3]
        for number in range(4, 14)
    }
    far = {number: pose([*dice.uniform(-800.0, 800.0, 3), 0.0, 0.0, 0.0]) for number in range(14, 24)}
    listed = {f"B{number}": ListedFrame(f"B{number}", "", each) for number, each in {**own, **near, **far}.items()}
    labels = np.repeat(["1", "2", "3"], 12)
    points = np.concatenate([dice.uniform(-300.0, 300.0, (12, 3)) + [900.0, 500.0 * k, 600.0] for k in range(3)])
    real = points.copy()
    shift = dice.normal(size=3)
    real[labels == "3"] += shift / np.linalg.norm(shift) * 10.0 ** dice.uniform(-0.5, 2.0)
    noise = 10.0 ** dice.uniform(-1.3, 0.0)
    names = tuple(labels.tolist())
    frames = SpotFrames(names, ("",) * 36, tuple(f"B{name}" for name in names), {"base": listed, "tool": {}})
    found = find_wrong_frames(
        Observations(points, frames=frames), real + dice.normal(0.0, noise, (36, 3)), same_frame=False, seed=0
    )
    assert not any(effect.named for effect in found.effects)
