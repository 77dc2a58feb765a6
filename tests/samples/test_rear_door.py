"""The rear door's programs hold what its README says. Read with regular expressions only, not with respot's reader."""

import csv
import itertools
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import RigidTransform, Rotation

ROOT = Path(__file__).parents[2]
DOOR = ROOT / "samples" / "rear_door"
KUKA, ABB = DOOR / "kuka/KRC/R1", DOOR / "abb/RAPID/TASK1"
SHIFT = RigidTransform.from_translation([67.0, -20.0, 27.0])  # about what a calibration to theory.csv asks for
NUMBER = r"-?\d+(?:\.\d*)?(?:E[+-]\d+)?"


def text(path):
    return path.read_bytes().decode("cp1252")


def table(name):
    with (DOOR / name).open(encoding="ascii", newline="") as file:
        return {row["id"]: np.array([float(row[c]) for c in "xyz"]) for row in csv.DictReader(file)}


# ------------------------------------------------------------------------------------------------ a small reader


def frame(line):
    x, y, z, a, b, c = (float(re.search(rf"\b{name} ({NUMBER})", line)[1]) for name in "XYZABC")
    return RigidTransform.from_components([x, y, z], Rotation.from_euler("ZYX", [a, b, c], degrees=True))


def pose(numbers):
    return RigidTransform.from_components(numbers[:3], Rotation.from_quat(numbers[3:7], scalar_first=True))


def numbers(part):
    return [float(n) for n in re.findall(NUMBER, part)]


def kuka_points(module):
    """name -> (world pose, status, turn, E1, line)"""
    config = text(KUKA / "System/$config.dat")
    dat = text(KUKA / f"Program/{module}.dat")
    points = {}
    for name, line, s, t, e1 in re.findall(rf"E6POS X(\w+)=({{.*?,S (\d+),T (\d+),E1 ({NUMBER}).*)", dat):
        base = re.search(rf"FDAT F{name}={{TOOL_NO 1,BASE_NO (\d+),IPO_FRAME #BASE", dat)[1]
        line_of_base = re.search(rf"(?m)^BASE_DATA\[{base}\]=(.*)", config)[1]
        points[name] = (frame(line_of_base) * frame(line), int(s), int(t), float(e1), line)
    return points


def abb_frame(wobj):
    n = numbers(re.search(rf"{wobj}:=\[FALSE,TRUE,\"\",(.*)\];", text(ABB / "SYSMOD/WeldData.sys"))[1])
    return pose(n[:7]) * pose(n[7:])


def abb_points(module):
    """name -> (world pose, confdata, eax, text); inline targets by the spot in their spotdata"""
    source = text(ABB / f"PROGMOD/{module}.mod")
    points = {}
    literal = r"(\[\[.*?\],\[.*?\],\[.*?\],\[.*?\]\])"
    found = [(n, t) for n, t in re.findall(rf"robtarget (\w+):={literal};", source)]
    wobjs = dict(re.findall(r"(?m)^ +(?:Move|Spot)\w+ (?:Offs\()?(\w+)\b.*WObj:=(\w+);", source))
    for target, rest, wobj in re.findall(rf"(?m)^ +(?:Move|Spot)\w {literal}(.*)\\WObj:=(\w+);", source):
        spot = re.search(r"sd_(\w+)", rest)
        name = spot[1] if spot else "inline"
        found.append((name, target))
        wobjs[name] = wobj
    for name, target in found:
        n = numbers(target)
        points[name] = (abb_frame(wobjs[name]) * pose(n[:7]), n[7:11], n[11:], target)
    return points


KUKA_MODULES = ("rear_door_u", "rear_door_o", "tip_dress")


def kuka_weld_points():
    """Return the points of both rows; approach points carry their module, for P10 stands in each."""
    return {
        name if name.startswith("P02WP") else f"{module}.{name}": point
        for module in KUKA_MODULES[:2]
        for name, point in kuka_points(module).items()
    }


WELD = {"kuka": kuka_weld_points, "abb": lambda: abb_points("RearDoor")}


# ----------------------------------------------------------------------------------------------------- the robots


def along(x=0.0, y=0.0, z=0.0):
    return RigidTransform.from_translation([x, y, z])


def turn(axis, degrees):
    return RigidTransform.from_rotation(Rotation.from_euler(axis, degrees, degrees=True))


def kuka_flange(q):
    arm = along(z=675) * turn("z", -q[0]) * along(x=350) * turn("y", q[1]) * along(x=1150) * turn("y", q[2])
    wrist = arm * along(x=1200, z=-41)
    return wrist * turn("x", -q[3]) * turn("y", q[4]) * turn("x", -q[5]) * along(x=215) * turn("y", 90), wrist


def abb_flange(q):
    arm = along(z=780) * turn("z", q[0]) * along(x=320) * turn("y", q[1]) * along(z=1125) * turn("y", q[2])
    wrist = arm * along(x=1142.5, z=200)
    return wrist * turn("x", q[3]) * turn("y", q[4]) * turn("x", q[5]) * along(x=200) * turn("y", 90), wrist


def kuka_cell():
    machine, config = text(KUKA / "Mada/$machine.dat"), text(KUKA / "System/$config.dat")
    limits = [[float(re.search(rf"\$SOFT{e}_END\[{i}\]=(\S+)", machine)[1]) for e in "NP"] for i in range(1, 7)]
    model = KinematicModel(
        a1=350, a2=41, b=0, c1=675, c2=1150, c3=1200, c4=215,
        offsets=(0, -90, 0, 0, 0, 0), flip_axes=(True, False, False, True, False, True),
    )  # fmt: skip
    root = frame(re.search(r"\$ROBROOT=(.*)", machine)[1])
    tool = frame(re.search(r"(?m)^TOOL_DATA\[1\]=(.*)", config)[1])
    return Robot(model), np.array(limits), root, tool, kuka_flange


def abb_cell():
    moc = text(DOOR / "abb/SYSPAR/MOC.cfg")
    arms = re.findall(
        r'-name "rob1_\d" -use_arm_type[^-]*(?:-[^-]*?)*?-upper_joint_bound (\S+) -lower_joint_bound (\S+)', moc
    )
    limits = [[np.degrees(float(low)), np.degrees(float(high))] for high, low in arms]
    assert len(limits) == 6
    model = KinematicModel(
        a1=320, a2=-200, b=0, c1=780, c2=1125, c3=1142.5, c4=200, offsets=(0, 0, -90, 0, 0, 0), flip_axes=(False,) * 6
    )
    xyz = [1000 * float(re.search(rf"-base_frame_pos_{c} ({NUMBER})", moc)[1]) for c in "xyz"]
    u0, u3 = (float(re.search(rf"-base_frame_orient_{u} ({NUMBER})", moc)[1]) for u in ("u0", "u3"))
    tool = pose(numbers(re.search(r"tWeldGun1:=\[TRUE,(.*)", text(ABB / "SYSMOD/WeldData.sys"))[1])[:7])
    return Robot(model), np.array(limits), pose([*xyz, u0, 0, 0, u3]), tool, abb_flange


def solutions(cell, world):
    robot, limits, root, tool, flange = cell
    goal = root.inv() * world * tool.inv()
    found = robot.reach(goal, joint_limits=limits)
    inside = [q for q, m in zip(found.joints[0], found.limit_margin[0], strict=True) if np.isfinite(m) and m > 0]
    for q in inside:
        assert np.abs(flange(q)[0].as_matrix() - goal.as_matrix()).max() < 1e-6
    return inside


def kuka_configuration(q):
    _, wrist = kuka_flange(q)
    forward = turn("z", -q[0]).inv().apply(wrist.translation)[0]
    above = (turn("y", q[2]) * along(x=1200, z=-41)).translation[2] < 0  # the wrist hangs below the stretched upper arm
    return (forward < 0) + 2 * above + 4 * (q[4] < 0), sum(int(a < 0) << i for i, a in enumerate(q))


def abb_configuration(q):
    _, wrist = abb_flange(q)
    forward = turn("z", q[0]).inv().apply(wrist.translation)[0]
    lower_arm = (turn("y", q[2]) * along(x=1142.5, z=200)).translation[0]
    return [*np.floor(q[[0, 3, 5]] / 90), 4 * (forward < 0) + 2 * (lower_arm < 0) + (q[4] < 0)]


# ------------------------------------------------------------------------------------------------------- the tests


@pytest.mark.parametrize("brand", WELD)
def test_world_positions_are_the_actual_coordinates(brand):
    points, actual = WELD[brand](), table("actual.csv")
    assert {n for n in points if n.startswith("P02WP")} == set(actual) == set(table("theory.csv"))
    assert len(actual) == 14
    for name, xyz in actual.items():
        assert np.abs(points[name][0].translation - xyz).max() < 1e-4, name


@pytest.mark.parametrize("brand", WELD)
def test_gun_orientations_spread(brand):
    points, actual = WELD[brand](), table("actual.csv")

    def spread(names):
        rotations = [points[n][0].rotation for n in names]
        return max(np.degrees((a.inv() * b).magnitude()) for a, b in itertools.combinations(rotations, 2))

    assert spread(actual) > 60
    assert spread([n for n in actual if actual[n][2] < 1400]) > 20
    assert spread([n for n in actual if actual[n][2] > 1400]) > 20


@pytest.mark.parametrize("brand", WELD)
def test_the_gun_closes_along_the_flange_normal(brand):
    """Closing axis (KUKA X, ABB Z) by the flange, leaning to and fro; throat (KUKA Z, ABB X) to the car's front."""
    normal, throat = ([1, 0, 0], [0, 0, 1]) if brand == "kuka" else ([0, 0, 1], [1, 0, 0])
    for name, (world, *_) in WELD[brand]().items():
        if name.startswith("P02WP"):
            lean = -22 if world.translation[2] < 1400 else 35
            expected = np.array([np.sin(np.radians(lean)), 0, np.cos(np.radians(lean))])
            assert np.degrees(np.arccos(world.rotation.apply(normal) @ expected)) < 18, name
            assert world.rotation.apply(throat)[0] < -0.7, name


@pytest.mark.parametrize("brand", WELD)
def test_via_points_stand_off_the_spots(brand):
    points = WELD[brand]()
    spots = np.array([p[0].translation for n, p in points.items() if n.startswith("P02WP")])
    vias = {n: p for n, p in points.items() if not n.startswith("P02WP")}
    assert len(vias) >= 10
    for name, (world, *_) in vias.items():
        assert 55 < np.linalg.norm(spots - world.translation, axis=1).min() < 250, name


def test_kuka_status_and_turn_follow_from_joints():
    cell = kuka_cell()
    for module in KUKA_MODULES:
        states, last = set(), None
        for name, (world, status, turns, *_) in kuka_points(module).items():
            fitting = [q for q in solutions(cell, world) if kuka_configuration(q) == (status, turns)]
            assert fitting, (module, name)
            if last is not None:
                assert np.abs(fitting[0] - last).max() < 75, (module, name)
            last = fitting[0]
            states.add(status)
        assert states == {6}, module


def test_abb_confdata_follow_from_joints():
    cell = abb_cell()
    for module in ("RearDoor", "TipDress"):
        for name, (world, conf, *_) in abb_points(module).items():
            assert any(list(abb_configuration(q)) == conf for q in solutions(cell, world)), (module, name)
            assert conf[3] == 1, (module, name)


def implicit_points(brand):
    """Poses that no literal holds: geometric operator and relative moves, Offs and RelTool."""
    points = WELD[brand]()
    if brand == "kuka":
        src = text(KUKA / "Program/rear_door_u.src")
        name, z = re.search(r"LIN X(\w+):\{X 0,Y 0,Z (\S+),A 0,B 0,C 0\}", src).groups()
        tool = numbers(re.search(r"LIN_REL \{(.*)\} #TOOL", src)[1])
        x, y, dz = numbers(re.search(r"LIN_REL \{(.*)\} #BASE", src)[1])
        at = points["P02WP1615432"][0]
        base = frame(re.search(r"(?m)^BASE_DATA\[1\]=(.*)", text(KUKA / "System/$config.dat"))[1])
        return [
            points[name][0] * along(z=float(z)),
            points["P02WP1615435"][0] * along(*tool),
            along(*base.rotation.apply([x, y, dz])) * at,
        ]
    out = []
    for kind, name, x, y, z, wobj in re.findall(
        r"(Offs|RelTool)\((\w+),([^,]+),([^,]+),([^,)]+)\).*WObj:=(\w+);", text(ABB / "PROGMOD/RearDoor.mod")
    ):
        d = [float(x), float(y), float(z)]
        at = points[name][0]
        out.append(at * along(*d) if kind == "RelTool" else along(*abb_frame(wobj).rotation.apply(d)) * at)
    assert len(out) == 5
    return out


@pytest.mark.parametrize("brand", WELD)
@pytest.mark.parametrize("move", [along(), SHIFT], ids=["as found", "shifted"])
def test_every_point_can_be_reached_on_the_same_branch(brand, move):
    cell = kuka_cell() if brand == "kuka" else abb_cell()
    for world in [p[0] for p in WELD[brand]().values()] + implicit_points(brand):
        assert any(q[4] < -10 for q in solutions(cell, move * world)), world.translation


def test_bases():
    config = text(KUKA / "System/$config.dat")
    turned = frame(re.search(r"(?m)^BASE_DATA\[2\]=(.*)", config)[1]).rotation.as_euler("ZYX", degrees=True)
    assert abs(turned[0]) > 85
    assert all(abs(turned[1:]) > 0.5)
    for module, base in zip(KUKA_MODULES, ("1", "2", "5"), strict=True):
        assert set(re.findall(r"BASE_NO (\d+)", text(KUKA / f"Program/{module}.dat"))) == {base}
    assert np.degrees(abb_frame("wobjDoorUpper").rotation.magnitude()) > 80
    with_object_frame = numbers(re.search(r'Upper:=\[FALSE,TRUE,"",(.*)\];', text(ABB / "SYSMOD/WeldData.sys"))[1])[7:]
    assert all(with_object_frame[:3])
    assert abs(with_object_frame[3]) < 1 - 1e-5


def test_number_style():
    for module in KUKA_MODULES:
        for _, _, _, e1, line in kuka_points(module).values():
            assert re.findall(r"\b([A-Z]\d?) -?\d", line) == [*"XYZABCST", *(f"E{i}" for i in range(1, 7))]
            assert all(np.float32(n) == pytest.approx(float(n), rel=1e-8) for n in re.findall(r"\b[XYZ] (\S+?),", line))
            assert 10 < e1 < 180
    for module in ("RearDoor", "TipDress"):
        for _, _, eax, target in abb_points(module).values():
            assert eax[0] < 180
            assert target.count("9E+09") == 5
            assert np.linalg.norm(numbers(target)[3:7]) == pytest.approx(1, abs=2e-9)
    positions = [n for _, _, _, t in abb_points("RearDoor").values() for n in re.findall(NUMBER, t)[:3]]
    assert np.mean([len(n.partition(".")[2]) >= 5 for n in positions]) > 0.7
    assert min(len(n.partition(".")[2]) for n in positions) >= 4


def robot_files():
    return [p for brand in ("kuka", "abb") for p in sorted((DOOR / brand).rglob("*")) if p.is_file()]


@pytest.mark.parametrize("path", robot_files(), ids=lambda p: p.relative_to(DOOR).as_posix())
def test_bytes(path):
    body = path.read_bytes()
    assert not re.search(
        rb"[\xc2-\xf4][\x80-\xbf]|[\x00\x1a\x7f]|^\xef\xbb\xbf", body
    )  # no UTF-8, no BOM, no end-of-file marks
    assert not re.search(rb"\r(?!\n)", body)
    if path.name == "backinfo.txt":
        assert b"\r" not in body
    elif path.suffix == ".cfg":
        assert b"\r\n" in body
        assert re.search(rb"\\\n", body)
    elif path.suffix != ".guid":
        assert not re.search(rb"(?<!\r)\n", body)
        assert body.endswith(b"\r\n")
        assert not body.endswith(b"\r\n\r\n")
    if path.name in {
        "rear_door_u.src",
        "rear_door_o.src",
        "tip_dress.src",
        "RearDoor.mod",
        "TipDress.mod",
        "$config.dat",
    }:
        assert re.search(rb"[\xe4\xf6\xfc\xdf]", body)


def test_umlauts_stand_in_comment_title_and_string():
    u = text(KUKA / "Program/rear_door_u.src")
    assert ";FOLD Freifahren über Spanner 3" in u
    assert ";Kühlwasser" in u
    assert "Base[5]:KAPPENFRÄSER" in text(KUKA / "Program/tip_dress.src")
    assert 'cStation[]="Heckklappe Schweißzelle 140"' in text(KUKA / "System/$config.dat")
    assert 'TPWrite "Grundstellung prüfen"' in text(ABB / "PROGMOD/MainModule.mod")


def test_kuka_forms_agree_with_their_data():
    """Fold title, %P fields, body and .dat say the same; folds balance; names fit 24 characters."""
    for module in KUKA_MODULES:
        src, dat = text(KUKA / f"Program/{module}.src"), text(KUKA / f"Program/{module}.dat")
        assert len(re.findall(r"(?m)^ *;FOLD", src)) == len(re.findall(r"(?m)^ *;ENDFOLD", src))
        declared = set(re.findall(r"(?m)^DECL \w+ (\w+)=", dat)) | {"PDEFAULT", "FHOME", "XHOME"}
        forms = re.findall(r"(?ms)^;FOLD (SPOT )?(PTP|LIN) (\w+)[^;]*;([^\r]*)\r\n(.*?);ENDFOLD", src)
        assert len(forms) > 6
        for spot, kind, name, tail, body in forms:
            assert bool(spot) == name.startswith("P02WP") == ("%MKUKATPSPOT" in tail)
            assert f"%V{kind},%P 1:{kind}, 2:{name}, " in tail
            assert re.search(rf"(?m)^{kind} X{name}\b", body)
            used = [*re.findall(r"(?:[PLF]DAT_ACT|S_ACT)=(\w+)", body), f"X{name}"]
            assert set(used) <= declared, (module, name)
        assert all(len(n) <= 24 for n in re.findall(r"\w+", re.sub(r'"[^"]*"|;[^\r]*', "", src + dat)))
        assert re.search(r'POINT1\[\] ".{24}"', dat)


def test_the_generator_is_clean():
    run = subprocess.run(
        [sys.executable, ROOT / "scripts/make_rear_door.py", "--check"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "respot" not in re.findall(r"(?m)^(?:from|import) (\w+)", text(ROOT / "scripts/make_rear_door.py"))
