"""Converted backups, judged by a reader that shares nothing with respot."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from tests.convert.independent import NUMBER, SAMPLES, RobotFiles, from_abb, from_kuka, table

HEADER = re.compile(r"[ \t]*[;!]respot: [^\r\n]*\r\n")


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def converted(robot: RobotFiles, theory: Path, tmp_path: Path) -> tuple[Path, dict]:
    code, out, err = run("convert", robot.root, "--theory", theory, "-o", tmp_path / "out", "--json")
    assert code == 0, err
    return tmp_path / "out", json.loads(out)


def independent_fit(robot: RobotFiles) -> np.ndarray:
    """4x4 source2reference by Kabsch on the printed tables, with the two names exchanged."""
    actual, theory = table(SAMPLES / "actual.csv"), table(SAMPLES / "theory.csv")
    exchanged = {"P02WP1615442": "P02WP1609713", "P02WP1609713": "P02WP1615442"}
    source = np.array([actual[name] for name in actual])
    reference = np.array([theory[exchanged.get(name, name)] for name in actual])
    u, _, vt = np.linalg.svd((reference - reference.mean(0)).T @ (source - source.mean(0)))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, reference.mean(0) - rotation @ source.mean(0)
    return made


def test_every_target_in_scope_is_the_transform_of_the_old_one(robot, converted):
    folder, record = converted
    transform = np.eye(4)
    transform[:3, :3] = record["fit"]["transform"]["rotation"]
    transform[:3, 3] = record["fit"]["transform"]["translation"]
    # the transform itself is right, to the rounding of the points (5e-5 mm over a lever of 4 m)
    assert np.abs(transform[:3, :3] - independent_fit(robot)[:3, :3]).max() < 1e-6
    centre = np.append(np.mean(list(table(SAMPLES / "actual.csv").values()), axis=0), 1.0)
    assert np.abs((transform - independent_fit(robot)) @ centre).max() < 1e-4
    old, new = robot.read(robot.root), robot.read(folder)
    assert old.keys() == new.keys()
    moved = [name for name in old if name.split(".")[0] in robot.welding]
    assert len(moved) >= 27
    for name in moved:
        wanted = np.linalg.inv(old[name].base) @ transform @ old[name].base @ old[name].pose
        made, decimals = new[name].pose, [len(text.partition(".")[2]) for text in new[name].numbers]
        half = [0.5 * 10.0**-count * 1.001 + 1e-11 for count in decimals]
        assert (np.abs(made[:3, 3] - wanted[:3, 3]) <= half[:3]).all(), name
        unit = np.radians(1.0) if robot.name == "kuka" else 2.0
        assert np.abs(made[:3, :3] - wanted[:3, :3]).max() <= 3 * unit * max(half[3:]), name
        assert min(decimals[:3]) >= 3 and min(decimals[3:]) >= (4 if robot.name == "kuka" else 7)
        assert all(
            new_count >= len(text.partition(".")[2])
            for new_count, text in zip(decimals, old[name].numbers, strict=True)
        )
        assert new[name].rest == old[name].rest  # external axes


def test_calibrated_spots_lie_where_the_fit_says(robot, converted):
    folder, record = converted
    new = {name.split(".")[1]: point for name, point in robot.read(folder).items()}
    for spot in record["fit"]["spots"]:
        world = new[spot["id"]].base @ new[spot["id"]].pose
        assert np.abs(world[:3, 3] - [spot["x"], spot["y"], spot["z"]]).max() < 1e-4


def test_snapped_welds_lie_where_the_theory_says(robot, theory, tmp_path):
    code, out, err = run("convert", robot.root, "--theory", theory, "--snap", "-o", tmp_path / "out", "--json")
    assert code == 0, err
    record, listed = json.loads(out), table(theory)
    assert record["snap"]["spots"] == len(record["fit"]["spots"]) == 14
    new = {name.split(".")[1]: point for name, point in robot.read(tmp_path / "out").items()}
    for spot in record["fit"]["spots"]:
        world = new[spot["id"]].base @ new[spot["id"]].pose
        assert np.abs(world[:3, 3] - listed[spot["reference_id"]]).max() < 1e-4


def test_offsets_along_the_base_turn(robot, converted):
    folder, record = converted
    transform = np.array(record["fit"]["transform"]["rotation"])
    base = {"kuka": "rear_door_u.P10", "abb": "RearDoor.pLow10"}[robot.name]
    turned = robot.read(robot.root)[base].base[:3, :3]
    files = [path for path in robot.root.rglob("*") if path.is_file()]
    old = [path for path in files if re.search(robot.offsets, path.read_bytes().decode("latin-1"))]
    checked = 0
    for file in old:
        was = re.findall(robot.offsets, file.read_bytes().decode(robot.encoding))
        now = re.findall(robot.offsets, (folder / file.relative_to(robot.root)).read_bytes().decode(robot.encoding))
        for before, after in zip(was[:2], now[:2], strict=True):  # of the lower row, whose base is known above
            d_old = np.array([float(text) for text in re.findall(NUMBER, before)][:3])
            d_new = np.array([float(text) for text in re.findall(NUMBER, after)][:3])
            assert np.abs(d_new - turned.T @ transform @ turned @ d_old).max() <= 0.5e-3 * 1.001
            assert np.abs(d_new - d_old).max() > 0.05
            checked += 1
    assert checked == {"kuka": 1, "abb": 2}[robot.name]


def test_only_numbers_of_moved_targets_and_the_header_change(robot, converted):
    folder, record = converted
    edited = {edit["path"] for edit in record["edits"]}
    assert len(edited) >= 1
    files = sorted(path.relative_to(robot.root).as_posix() for path in robot.root.rglob("*") if path.is_file())
    written = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert written == sorted([*files, "respot.json"])
    for path in files:
        old, new = (robot.root / path).read_bytes(), (folder / path).read_bytes()
        if path not in edited:
            assert old == new, path
            continue
        text = new.decode(robot.encoding)
        assert len(HEADER.findall(text)) == 3
        head = text[: HEADER.search(text).start()].rstrip("\r\n").splitlines()[-1]
        assert re.match(r"(DEF|DEFDAT|MODULE)\b", head), head
        old_lines, new_lines = old.decode(robot.encoding).split("\r\n"), HEADER.sub("", text).split("\r\n")
        assert len(old_lines) == len(new_lines)
        moved = {edit["line"] for edit in record["edits"] if edit["path"] == path}
        for number, (before, after) in enumerate(zip(old_lines, new_lines, strict=True), 1):
            if number not in moved:
                assert before == after
            else:
                assert re.sub(NUMBER, "#", before) == re.sub(NUMBER, "#", after)


def test_configurations_stay_integers_and_those_that_must_change_do(robot, converted):
    """The shift carries axis 1 of a few spots across zero: stale numbers would unwind the gun arm."""
    folder, _ = converted
    pattern = {"kuka": r"X(\w+)=\{[^}]*,S ([^,]+),T ([^,]+),", "abb": r"(\w+):=\[\[[^]]*\],\[[^]]*\],\[([^]]*)\]()"}[
        robot.name
    ]
    old, new = {}, {}
    for found, root in ((old, robot.root), (new, folder)):
        for path in root.rglob("*"):
            if path.suffix in (".dat", ".mod") and path.stem in robot.welding:
                for name, *numbers in re.findall(pattern, path.read_bytes().decode(robot.encoding)):
                    found[path.stem, name] = numbers
    assert old.keys() == new.keys()
    for numbers in new.values():
        assert all(re.fullmatch(r"-?\d+", number) for text in numbers if text for number in text.split(","))
    changed = {name for name in old if old[name] != new[name]}
    assert (
        changed
        == {
            "kuka": {("rear_door_u", "P40"), ("rear_door_u", "P02WP1615438")},
            "abb": {("RearDoor", "P02WP1615434")},
        }[robot.name]
    )


def test_home_dresser_and_gun_stay(robot, converted):
    folder, record = converted
    old, new = robot.read(robot.root), robot.read(folder)
    dresser = [name for name in old if name.split(".")[0] not in robot.welding]
    assert len(dresser) == 3
    for name in dresser:
        assert old[name].numbers == new[name].numbers
    codes = {(stay["target"], stay["code"]) for stay in record["unmoved"]}
    home = {"kuka": "XHOME", "abb": "jHome"}[robot.name]
    assert (home, "JOINT_TARGET") in codes
    assert sum(code == "OUT_OF_SCOPE" for _, code in codes) == 3


def test_orientations_move_with_positions(robot, converted):
    folder, record = converted
    old, new = robot.read(robot.root), robot.read(folder)
    angle = np.linalg.norm(np.array(record["fit"]["transform"]["rotation"]) - np.eye(3))
    assert angle > 1e-3
    for name in old:
        if name.split(".")[0] in robot.welding:
            before, after = old[name].base @ old[name].pose, new[name].base @ new[name].pose
            assert np.linalg.norm(after[:3, :3] - before[:3, :3]) == pytest.approx(angle, rel=1e-3)


def test_a_second_run_of_the_same_calibration_is_refused(robot, theory, tmp_path):
    saved, first, second = tmp_path / "cal.json", tmp_path / "first", tmp_path / "second"
    assert run("fit", robot.root, "--theory", theory, "-o", saved)[0] == 0
    assert run("convert", robot.root, "-c", saved, "-o", first)[0] == 0
    code, _, err = run("convert", first, "-c", saved, "-o", second)
    assert code == 2
    assert "ALREADY_APPLIED" in err
    assert not second.exists()


def test_an_identity_calibration_changes_no_byte(robot, theory, tmp_path):
    saved = tmp_path / "identity.json"
    made = calibration_of(np.eye(3), [0.0, 0.0, 0.0])
    saved.write_text(made)
    code, out, err = run("convert", robot.root, "-c", saved, "-o", tmp_path / "out", "--json")
    assert code == 0, err
    assert json.loads(out)["edits"] == []
    for path in robot.root.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (tmp_path / "out" / path.relative_to(robot.root)).read_bytes()


def calibration_of(rotation, translation) -> str:
    from respot.calibration.calibration import Calibration

    ids = tuple(table(SAMPLES / "actual.csv"))
    return Calibration(np.array(rotation), np.array(translation), "theory", "same", ids).to_json()


def test_a_shift_beyond_the_limit_refuses_the_program(robot, tmp_path):
    saved = tmp_path / "far.json"
    saved.write_text(calibration_of(np.eye(3), [151.0, 0.0, 0.0]))
    code, out, _ = run("convert", robot.root, "-c", saved, "-o", tmp_path / "out", "--json")
    record = json.loads(out)
    assert code == 1
    assert record["edits"] == []
    assert {item["code"] for item in record["refused"]} == {"SHIFT_TOO_LARGE"}
    for path in robot.root.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (tmp_path / "out" / path.relative_to(robot.root)).read_bytes()


def test_a_dry_run_writes_nothing(robot, theory, tmp_path):
    code, out, _ = run("convert", robot.root, "--theory", theory, "-o", tmp_path / "out", "--dry-run", "--json")
    assert code == 0
    assert json.loads(out)["edits"]
    assert list(tmp_path.iterdir()) == []


def test_a_calibration_of_another_robot_is_refused(tmp_path):
    """The KUKA's calibration on the ABB: both weld the same spots of the same door, but each has its own deviation."""
    fitted = CliRunner().invoke(
        app, ["fit", str(SAMPLES / "kuka"), "--theory", str(SAMPLES / "theory.csv"), "-o", str(tmp_path / "cal.json")]
    )
    assert fitted.exit_code == 0
    result = CliRunner().invoke(
        app, ["convert", str(SAMPLES / "abb"), "-c", str(tmp_path / "cal.json"), "-o", str(tmp_path / "out")]
    )
    assert result.exit_code == 2
    assert "ANOTHER_ROBOT" in result.stderr and "--any-robot" not in result.stderr
    assert not (tmp_path / "out").exists()


TOOLS = {
    "kuka": ("KRC/R1/System/$config.dat", r"^TOOL_DATA\[1\]=\{(.*?)\}"),
    "abb": ("RAPID/TASK1/SYSMOD/WeldData.sys", r"tWeldGun1:=\[TRUE,(\[\[.*?\]\]),"),
}


def tool_of(robot: RobotFiles, folder: Path) -> np.ndarray:
    path, pattern = TOOLS[robot.name]
    text = re.search(pattern, (folder / path).read_bytes().decode("latin-1"), re.M)[1]
    read = from_kuka if robot.name == "kuka" else from_abb
    return read(*(float(value) for value in re.findall(NUMBER, text)))


def test_frames_and_points_give_the_same_flange_poses(robot, theory, converted, tmp_path):
    points, _ = converted
    code, out, err = run(
        "convert", robot.root, "--theory", theory, "-o", tmp_path / "frames", "--apply", "frames", "--json"
    )
    assert code == 0, err
    assert sorted(edit["depth"] for edit in json.loads(out)["edits"] if edit["shift_mm"]) == ["base", "base"]
    one, other = robot.read(points), robot.read(tmp_path / "frames")
    moved = [name for name in one if name.split(".")[0] in robot.welding]
    assert len(moved) >= 27
    for name in moved:
        flanges = [
            read[name].base @ read[name].pose @ np.linalg.inv(tool_of(robot, folder))
            for read, folder in ((one, points), (other, tmp_path / "frames"))
        ]
        assert np.linalg.norm((flanges[0] - flanges[1])[:3, 3]) < 1e-3, name
        assert np.abs((flanges[0] - flanges[1])[:3, :3]).max() < 2e-6, name
