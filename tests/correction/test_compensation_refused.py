"""What a compensation refuses, leaves and says; small backups, and calibrations written by hand."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.calibration.effects.term import Parameter, Term
from respot.cli import app
from tests.correction import small
from tests.correction.simulated import KUKA, cell
from tests.correction.small import CONFIG, SPOTS, fdat, krl, krl_in_base1, krl_point, lin, rapid
from tests.correction.test_external_tcp import krl_held_part
from tests.difference.witness import assert_witnessed

GROWTH = 2.0  # mm per m
CENTRE = [1000.0, 200.0, 400.0]
SCALE = Term("scale", {}, (Parameter("growth", "mm/m", 2.0),), {"centre": CENTRE})
ZERO = Term("joint_zero", {"axis": 3}, (Parameter("offset", "deg", 1.0),))
STATION = Term(
    "group_shift",
    {"column": "station", "level": "B"},
    tuple(Parameter(axis, "mm", 10.0) for axis in "xyz"),
    {"moves": "shift", "centre": CENTRE, "known": ["A", "B"]},
    own="station",
)
OTHER_BASE = Term(
    "wrong_frame",
    {"frame": "base", "written": "BASE_DATA[1]", "real": "BASE_DATA[2]"},
    (),
    {"translation": [0.0, 0.0, 5.0], "quaternion": [1.0, 0.0, 0.0, 0.0]},
)


class Run:
    """A conversion of a small backup by a calibration written by hand."""

    def __init__(self, tmp_path: Path, files: dict[str, str]) -> None:
        self.folder, self.backup = tmp_path, tmp_path / "backup"
        for path, text in files.items():
            place = self.backup / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(text.replace("\n", "\r\n").encode("latin-1"))

    def __call__(
        self,
        term: Term | None,
        value,
        *options: str,
        ids=tuple(SPOTS),
        force=True,
        frame="free",
        shift=(0, 0, 0),
        **more,
    ):
        terms = () if term is None else (term,)
        values = () if term is None else (np.atleast_1d(np.asarray(value, dtype=float)),)
        made = Calibration(np.eye(3), np.array(shift), "measured", frame, ids, terms=terms, values=values, **more)
        made.save(self.folder / "cal.json")
        out = self.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        arguments = ["convert", str(self.backup), "-c", str(self.folder / "cal.json"), "-o", str(out), "--json"]
        result = CliRunner().invoke(app, [*arguments, *(["--force"] if force else []), *options])
        record = json.loads(result.stdout) if result.stdout else {}
        if record and out.is_dir():
            assert_witnessed(record["edits"], self.backup, out)
        return small.Converted(result.exit_code, record, result.stderr, out)


def codes(done) -> set[str]:
    return {issue["code"] for issue in done.record["issues"]}


def krl_xyz(done, name: str) -> np.ndarray:
    numbers = re.search(rf"X{name}=\{{X (\S+?),Y (\S+?),Z (\S+?),", done.text("weld.dat"))
    return np.array([float(number) for number in numbers.groups()])


def in_world(place) -> np.ndarray:
    """Point of BASE_DATA[1] in the world."""
    x, y, z = place
    return np.array([1000.0 - y, x, 500.0 + z])


def shrunk(point) -> np.ndarray:
    """Where the robot must be told to go to reach a point although it goes too far."""
    return CENTRE + (np.asarray(point, dtype=float) - CENTRE) / (1.0 + GROWTH / 1000.0)


def test_a_scale_is_taken_off_where_bases_are_remeasured(tmp_path):
    done = Run(tmp_path, krl())(SCALE, GROWTH, "--bases", "remeasured")
    assert done.code == 0, done.err
    for name, place in SPOTS.items():
        assert in_world(krl_xyz(done, name)) == pytest.approx(shrunk(place), abs=6e-4)
    assert done.record["direction"] == "compensate"
    assert done.record["bases"] == "remeasured"
    assert "compensate measured, for the real cell" in done.text("weld.dat")


@pytest.mark.parametrize("growth", [0.0, GROWTH])
def test_in_one_frame_the_rigid_part_is_an_error_too(tmp_path, growth):
    """--frame same: the tracker stands in the robot's own coordinates, and sees it 3 mm off."""
    shift = np.array([2.0, -1.0, 2.0])
    run = Run(tmp_path, krl())
    done = run(SCALE if growth else None, growth, frame="same", shift=shift)
    assert done.code == 0, done.err
    assert done.record["direction"] == "compensate"
    for name, place in SPOTS.items():
        told = in_world(krl_xyz(done, name))
        lands = CENTRE + (told - CENTRE) * (1.0 + growth / 1000.0) + shift
        assert lands == pytest.approx(place, abs=2e-3)


TWO = {"T1": (100, 0, 0), "T2": (500, 0, 100), "T3": (100, 600, 0), "T4": (300, 300, 400), "T5": (0, 200, 350)}


def test_each_base_keeps_its_place_where_bases_are_kept(tmp_path):
    body = "".join(lin(name, weld=True) for name in TWO)
    data = "".join(krl_point(name, *place) + fdat(name, base=2) for name, place in TWO.items())
    done = Run(tmp_path, krl(body, data))(SCALE, GROWTH, ids=(*SPOTS, *TWO))
    assert done.code == 0, done.err
    assert [each["spots"] for each in done.record["left_to_registration"]] == [4, 5]
    for places, world in ((SPOTS, in_world), (TWO, np.asarray)):
        old = np.array(list(places.values()), dtype=float)
        new = np.array([world(krl_xyz(done, name)) for name in places])
        assert new.mean(axis=0) == pytest.approx(old.mean(axis=0), abs=6e-4)
        # each body shrinks about its own middle: nothing of it moves or turns as a whole
        around = old.mean(axis=0) + (old - old.mean(axis=0)) / (1.0 + GROWTH / 1000.0)
        assert new == pytest.approx(around, abs=1e-3)
    # the two are as far apart as they were
    assert np.abs(krl_xyz(done, "T1") - TWO["T1"]).max() > 0.1


def test_an_offset_leads_to_the_place_that_lands_right(tmp_path):
    body = "    MoveL Offs(S1,0,0,-300),v800,fine,tGun\\WObj:=wDoor;\n"
    done = Run(tmp_path, rapid(body))(SCALE, GROWTH, "--bases", "remeasured", "--keep-config")
    assert done.code == 0, done.err
    (offset,) = re.findall(r"Offs\(S1,([^)]*)\)", done.text("Weld.mod"))
    assert [float(text) for text in offset.split(",")] == pytest.approx([0, 0, -300 / 1.002], abs=6e-4)


def test_another_tool_has_not_the_error_of_the_fitted_one(tmp_path):
    via = krl_point("VIA", 300, 300, 300) + fdat("VIA").replace("TOOL_NO 1", "TOOL_NO 2")
    own = krl_point("OWN", 300, 300, 350) + fdat("OWN")
    files = krl(lin("VIA") + lin("OWN"), via + own)
    config = files["KRC/R1/System/$config.dat"]
    second = "TOOL_DATA[2]={X 5.0,Y 0.0,Z 90.0,A 0.0,B 0.0,C 0.0}\nBASE_DATA[1]"
    files["KRC/R1/System/$config.dat"] = config.replace("BASE_DATA[1]", second, 1)
    done = Run(tmp_path, files)(None, None, "--bases", "remeasured", tool_offset=np.array([0.0, 0.0, 3.0]))
    assert done.code == 0, done.err
    assert done.edited() == {*(f"X{name}" for name in SPOTS), "XOWN"}
    assert krl_xyz(done, "OWN") == pytest.approx([300, 300, 347], abs=6e-4)
    assert any("TOOL_DATA[2]" in issue["message"] for issue in done.record["issues"])


# ------------------------------------------------------------------------------------------------------------- limits


def test_no_target_moves_further_than_ten_millimetres(tmp_path):
    run = Run(tmp_path, krl())
    done = run(SCALE, 25.0, "--bases", "remeasured")
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"SHIFT_TOO_LARGE"}
    assert not done.edited()
    assert run(SCALE, 25.0, "--bases", "remeasured", "--max-shift", "40").code == 0


def test_no_target_leaves_the_rigid_motion_of_its_path(tmp_path):
    run = Run(tmp_path, krl())
    done = run(SCALE, 40.0, "--max-shift", "40", "--max-residual", "5")
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"RESIDUAL_TOO_LARGE"}
    assert not done.edited()


# ---------------------------------------------------------------------------------------------------- what is not known


def test_effects_of_the_arm_need_a_model_of_it(tmp_path):
    done = Run(tmp_path, krl())(ZERO, 0.1)
    assert done.code == 2
    assert "NO_KINEMATICS" in done.err
    assert not done.folder.exists()


def test_spots_under_another_frame_are_no_matter_of_points(tmp_path):
    done = Run(tmp_path, krl())(OTHER_BASE, [])
    assert done.code == 2
    assert "WRONG_FRAME" in done.err
    assert not done.folder.exists()


def test_another_state_of_the_backup_is_refused_without_force(tmp_path):
    done = Run(tmp_path, krl())(SCALE, GROWTH, force=False)
    assert done.code == 2
    assert "ANOTHER_SOURCE" in done.err
    assert not done.folder.exists()


def test_a_held_part_is_not_compensated(tmp_path):
    done = Run(tmp_path, krl_held_part())(SCALE, GROWTH)
    assert done.code == 2
    assert "EXTERNAL_TCP" in done.err
    assert not done.folder.exists()


def test_names_alone_leave_nothing_to_compensate(tmp_path):
    done = Run(tmp_path, krl())(None, None)
    assert done.code == 2
    assert "nothing to compensate" in done.err
    assert not done.folder.exists()


def test_what_an_effect_follows_must_be_known_of_every_spot(tmp_path):
    via = krl_point("VIA", 300, 300, 300) + fdat("VIA")
    run = Run(tmp_path, krl(lin("VIA"), via))
    blind = run(STATION, [1.0, 0.0, -2.0], "--bases", "remeasured")
    assert blind.code == 1
    assert {code for _, _, code in blind.refusals()} == {"EFFECT_NOT_KNOWN"}
    assert not blind.edited()
    table = tmp_path / "stations.csv"
    table.write_text("id,station\nS1,A\nS2,A\nS3,B\nS4,B\n")
    seen = run(STATION, [1.0, 0.0, -2.0], "--bases", "remeasured", "--covariates", str(table))
    assert seen.code == 0, seen.err
    # the way out goes with the spot that it comes from
    assert seen.edited() == {"XS3", "XS4", "XVIA"}
    assert in_world(krl_xyz(seen, "S3")) == pytest.approx(np.array(SPOTS["S3"]) - [1.0, 0.0, -2.0], abs=6e-4)
    table.write_text("id,station\nS1,A\nS2,A\nS3,B\n")
    some = run(STATION, [1.0, 0.0, -2.0], "--bases", "remeasured", "--covariates", str(table))
    assert ("weld", "XS4", "EFFECT_NOT_KNOWN") in {
        (program.lower(), target, code) for program, target, code in some.refusals()
    }
    assert not some.edited()  # all or nothing


# -------------------------------------------------------------------------------------------------------- real backups


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return cell(tmp_path_factory.mktemp("plant"), KUKA, "joint_zero@3", spots=30)


def test_compensated_points_are_not_compensated_again(plant, tmp_path):
    """They no longer say where spots should be: neither the old measurement nor a fresh one tells that."""
    made = plant.convert(tmp_path / "out", ("joint_zero",))
    made.calibration.save(tmp_path / "cal.json")

    def convert(source: str, out: str, *options: str):
        return CliRunner().invoke(app, ["convert", str(tmp_path / source), *options, "-o", str(tmp_path / out)])

    fit = ("--measured", str(plant.measured), "--noise", "0.1", "--effects", "joint_zero")
    stored = ("-c", str(tmp_path / "cal.json"))
    shutil.copytree(tmp_path / "out", tmp_path / "bare")
    (tmp_path / "bare" / "respot.json").unlink()  # as the robot hands them back: headers alone
    for source, options in (("out", fit), ("bare", fit), ("out", (*stored, "--force"))):
        again = convert(source, "twice", *options)
        assert again.exit_code == 2
        assert "ALREADY_APPLIED" in again.stderr
        assert not (tmp_path / "twice").exists()
    # the way back goes once, and from there the way is open again
    assert convert("bare", "back", *stored, "--inverse").exit_code == 0
    assert convert("back", "twice", *stored, "--inverse").exit_code == 2
    assert convert("back", "fresh", *fit).exit_code == 0


def changed(plant, tmp_path: Path, pattern: str, old: str, new: str) -> Path:
    """Copy of the backup with a text of its files replaced."""
    backup = tmp_path / "changed"
    shutil.copytree(plant.backup, backup)
    count = 0
    for path in backup.rglob(pattern):
        text = path.read_bytes().decode("cp1252")
        count += old in text
        path.write_bytes(text.replace(old, new).encode("cp1252"))
    assert count
    return backup


def compensate(plant, backup: Path, tmp_path: Path, *options: str):
    model = Calibration(
        np.eye(3), np.zeros(3), "measured", "free", tuple(plant.line.ids), terms=(ZERO,), values=(np.array([0.05]),)
    )
    model.save(tmp_path / "cal.json")
    arguments = ["convert", str(backup), "-c", str(tmp_path / "cal.json"), "-o", str(tmp_path / "out"), "--force"]
    return CliRunner().invoke(app, [*arguments, "--json", *options])


def test_a_controller_that_compensates_itself_is_left_alone(plant, tmp_path):
    accurate = "$ABS_ACCUR=TRUE\r\nINT $TRAFO_AXIS=6"
    backup = changed(plant, tmp_path, "$machine.dat", "INT $TRAFO_AXIS=6", accurate)
    result = compensate(plant, backup, tmp_path)
    assert result.exit_code == 2
    assert "ABSOLUTE_ACCURACY" in result.stderr


def test_points_that_say_so_are_left_alone(plant, tmp_path):
    name = plant.line.ids[0]
    (path,) = [p for p in plant.backup.rglob("*.dat") if f"DECL E6POS X{name}=" in p.read_bytes().decode("cp1252")]
    (old,) = re.findall(rf"DECL E6POS X{name}=.*?,S \d+,", path.read_bytes().decode("cp1252"))
    status = int(re.search(r"S (\d+),$", old)[1])
    backup = changed(plant, tmp_path, path.name, old, re.sub(r"S \d+,$", f"S {status | 16},", old))
    result = compensate(plant, backup, tmp_path)
    assert result.exit_code == 1
    refused = json.loads(result.stdout)["refused"]
    assert (f"X{name}", "ABSOLUTE_ACCURACY") in {(each["target"], each["code"]) for each in refused}


def test_joints_that_are_not_known_refuse_their_program_alone(plant, tmp_path):
    name = plant.line.ids[0]
    (path,) = [p for p in plant.backup.rglob("*.dat") if f"DECL E6POS X{name}=" in p.read_bytes().decode("cp1252")]
    (old,) = re.findall(rf"DECL E6POS X{name}=.*?,S \d+,", path.read_bytes().decode("cp1252"))
    status = int(re.search(r"S (\d+),$", old)[1])
    backup = changed(plant, tmp_path, path.name, old, re.sub(r"S \d+,$", f"S {status ^ 2},", old))
    result = compensate(plant, backup, tmp_path)
    assert result.exit_code == 1
    record = json.loads(result.stdout)
    refused = {(each["target"], each["code"]) for each in record["refused"]}
    assert (f"X{name}", "EFFECT_NOT_KNOWN") in refused
    assert {each["program"].lower() for each in record["refused"]} == {path.stem.lower()}
    assert record["edits"]
    assert not [edit for edit in record["edits"] if Path(edit["path"]).stem == path.stem]


def test_words_that_options_do_not_know(plant, tmp_path):
    result = compensate(plant, plant.backup, tmp_path, "--bases", "moved")
    assert result.exit_code == 2
    assert "--bases" in result.stderr


def test_a_small_config_is_used_here(tmp_path):
    assert "BASE_DATA[2]={X 0.0" in CONFIG  # the second base of these tests is the world's
    assert krl_in_base1((1000, 0, 500)) == (0.0, -0.0, 0.0)
