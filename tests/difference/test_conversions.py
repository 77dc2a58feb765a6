"""What `convert` claims and what `diff` sees agree, on every sample and on small programs.

The tests of corrections hold every conversion that they make against `diff` as well (`tests.correction.small`).
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from respot.backups import open_backup
from respot.calibration.calibration import Calibration
from respot.spots import spots_of_robot
from tests.convert.independent import ROBOTS
from tests.correction.small import SHIFT, TURN, convert, krl, krl_point, lin, rapid, robtarget
from tests.difference.witness import assert_agree, assert_witnessed, diff, run

ROOT = Path(__file__).parents[2]
SMALL_TURN = np.array([[1, -0.002, 0], [0.002, 1, 0], [0, 0, 1]]) / np.array([np.hypot(1, 0.002)] * 2 + [1])
BACKUPS = [
    *sorted((ROOT / "samples").glob("*/*/backup")),
    *sorted((ROOT / "samples" / "rear_door").glob("[ka]*[ab]")),
]
NAMES = [path.relative_to(ROOT).as_posix() for path in BACKUPS]


@pytest.mark.parametrize("backup", BACKUPS, ids=NAMES)
def test_edits_are_what_is_seen(backup, tmp_path):
    ids = spots_of_robot(open_backup(backup).robot()).ids
    made = Calibration(SMALL_TURN, np.array([2.0, -3.0, 1.0]), "theory", "same", tuple(ids))
    (tmp_path / "cal.json").write_text(made.to_json())
    options = ("-c", tmp_path / "cal.json", "-o", tmp_path / "out", "--keep-config", "--partial", "--json")
    code, out, err = run("convert", backup, *options)
    assert code in (0, 1), err
    edits = json.loads(out)["edits"]
    assert len(edits) > 20
    assert_witnessed(edits, backup, tmp_path / "out")


def inline(x, y, z) -> str:
    return f"    MoveL {robtarget(x, y, z)},v100,z10,tGun\\WObj:=wDoor;\n"


BODIES = {
    "krl_relative": krl(lin("S1") + "LIN_REL {X 10.0,Y 20.0,Z 0.0} #BASE\n"),
    "krl_tool_shift": krl(lin("S1", "XS1:{X 0,Y 0,Z -60,A 0,B 0,C 0}")),
    "krl_shared": krl(lin("V1") + lin("V1"), krl_point("V1", 5, 6, 7) + 'DECL FDAT FV1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE,POINT2[] " "}\n'),
    "rapid_inline": rapid(inline(5, 6, 7) + inline(8, 9, 10)),
    "rapid_offs": rapid("    MoveL Offs(S1,10,20,30),v100,z10,tGun\\WObj:=wDoor;\n"),
    "rapid_reltool": rapid("    MoveL RelTool(S1,0,0,-30),v100,z10,tGun\\WObj:=wDoor;\n"),
    "rapid_original": rapid("    MoveL p5,v100,z10,tGun\\WObj:=wDoor;\n", f"  CONST robtarget p5:={robtarget(1, 2, 3)};\n  CONST o_robtarget o_p5:={robtarget(1, 2, 4)};\n"),
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_the_edits_of_small_programs_are_what_is_seen(name, tmp_path):
    done = convert(tmp_path, BODIES[name], "--keep-config", translation=SHIFT)
    assert done.code == 0, done.err
    assert len(done.record["edits"]) >= 4
    assert_agree(done.record["edits"], diff(tmp_path / "backup", done.folder))
    assert np.abs(TURN - np.eye(3)).max() > 0.01


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_table_of_the_rear_door_is_the_transform_target_by_target(robot, tmp_path):
    theory = ROOT / "samples" / "rear_door" / "theory.csv"
    code, out, err = run("convert", robot.root, "--theory", theory, "-o", tmp_path / "out", "--json")
    assert code == 0, err
    converted = json.loads(out)
    (found,) = diff(robot.root, tmp_path / "out")["robots"]
    g = np.eye(4)
    g[:3, :3] = converted["fit"]["transform"]["rotation"]
    g[:3, 3] = converted["fit"]["transform"]["translation"]
    points = robot.read(robot.root)
    by_name = {name.split(".")[1]: [] for name in points}
    for name, point in points.items():
        by_name[name.split(".")[1]].append((name.split(".")[0].lower(), point))
    turn = np.degrees(np.arccos((np.trace(g[:3, :3]) - 1) / 2))
    checked = 0
    for item in found["moved"]:
        if item["kind"] != "pose":
            continue
        name = item["spot_id"] if "@" in item["target"] else item["target"].removeprefix("X")
        candidates = [point for program, point in by_name.get(name, ()) if program == item["program"].lower()]
        if len(candidates) != 1:
            continue
        (point,) = candidates
        before = point.base @ point.pose
        after = g @ before
        assert np.allclose([item["world"][axis] for axis in ("dx", "dy", "dz")], (after - before)[:3, 3], atol=1.5e-3)
        own = np.linalg.inv(point.base) @ after
        assert np.allclose([item["shift"][axis] for axis in ("dx", "dy", "dz")], (own - point.pose)[:3, 3], atol=1.5e-3)
        assert item["turn_deg"] == pytest.approx(turn, abs=2e-3)
        checked += 1
    assert checked >= 24
    assert_agree(converted["edits"], diff(robot.root, tmp_path / "out"))
