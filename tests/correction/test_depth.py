"""Depth changes where a number is written, never where the flange goes (DESIGN section 6)."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.convert.independent import NUMBER, from_abb, from_kuka
from tests.correction.simulated import ABB, KUKA, cell
from tests.correction.small import (
    DATA,
    SHIFT,
    SPOTS,
    TURN,
    Converted,
    convert,
    fdat,
    krl,
    krl_point,
    lin,
    rapid,
    robtarget,
)
from tests.correction.test_external_tcp import krl_held_part, rapid_held_part

FRAMES = ("--apply", "frames")


def numbers(text: str) -> list[float]:
    return [float(value) for value in re.findall(NUMBER, text)]


def krl_frame(folder: Path, name: str) -> np.ndarray:
    (path,) = folder.rglob("$config.dat")
    members = re.search(rf"^{re.escape(name)}=\{{(.*?)\}}", path.read_text("latin-1"), re.M)[1]
    return from_kuka(*(float(member.split()[1]) for member in members.split(",")[:6]))


def krl_pose(folder: Path, name: str, file: str = "weld.dat") -> np.ndarray:
    (path,) = folder.rglob(file)
    members = re.search(rf"X{name}=\{{(.*?)\}}", path.read_text("latin-1"))[1]
    return from_kuka(*(float(member.split()[1]) for member in members.split(",")[:6]))


def krl_flange(folder: Path, name: str, base: str = "BASE_DATA[1]", tool: str = "TOOL_DATA[1]") -> np.ndarray:
    return krl_frame(folder, base) @ krl_pose(folder, name) @ np.linalg.inv(krl_frame(folder, tool))


def rapid_datum(folder: Path, name: str) -> list[float]:
    texts = [path.read_text("latin-1") for path in folder.rglob("*") if path.suffix in (".mod", ".sys")]
    (found,) = [match[1] for text in texts if (match := re.search(rf"\b{name}(?:\{{\d\}})?:=(\[.*?\]);", text))]
    return numbers(found)


def rapid_flange(folder: Path, name: str, base: str = "wDoor", tool: str = "tGun") -> np.ndarray:
    frame, gun = rapid_datum(folder, base), rapid_datum(folder, tool)
    whole = from_abb(*frame[:7]) @ from_abb(*frame[7:14])
    return whole @ from_abb(*rapid_datum(folder, name)[:7]) @ np.linalg.inv(from_abb(*gun[:7]))


def both(tmp_path: Path, files: dict[str, str], *options: str) -> tuple[Converted, Converted]:
    points = convert(tmp_path / "points", files, *options)
    frames = convert(tmp_path / "frames", files, *FRAMES, *options)
    assert (points.code, frames.code) == (0, 0), points.err + frames.err
    return points, frames


def depths(done: Converted) -> dict[str, str]:
    return {edit["target"]: edit["depth"] for edit in done.record["edits"]}


def kept(done: Converted) -> str:
    return " / ".join(issue["message"] for issue in done.record["issues"] if issue["code"] == "FRAME_KEPT")


# ---------------------------------------------------------------------------------------------------------------- bases


def test_krl_a_deviation_goes_into_the_base_and_the_flange_goes_to_the_same_places(tmp_path):
    points, frames = both(tmp_path, krl(body="LIN_REL {X 10.0,Y 5.0} #BASE\n"))
    assert depths(frames) == {"BASE_DATA[1]": "base"}
    for name in SPOTS:
        assert krl_flange(frames.folder, name) == pytest.approx(krl_flange(points.folder, name), abs=1e-3)
    assert "LIN_REL {X 10.0,Y 5.0} #BASE" in frames.text("weld.src")  # it turns with the base
    assert "LIN_REL {X 10.0,Y 5.0} #BASE" not in points.text("weld.src")


def test_rapid_a_deviation_goes_into_the_work_object_and_the_flange_goes_to_the_same_places(tmp_path):
    body = "    MoveL Offs(S1,10,0,0),v100,z10,tGun\\WObj:=wDoor;\n    MoveL RelTool(S1,0,0,-5),v100,z10,tGun\\WObj:=wDoor;\n"
    points, frames = both(tmp_path, rapid(body=body), "--keep-config")
    assert depths(frames) == {"wDoor": "base"}
    for name in SPOTS:
        assert rapid_flange(frames.folder, name) == pytest.approx(rapid_flange(points.folder, name), abs=1e-3)
    assert "Offs(S1,10,0,0)" in frames.text("Weld.mod")


@pytest.mark.parametrize(
    ("user", "work", "changed"), [(False, True, "oframe"), (True, True, "oframe"), (True, False, "uframe")]
)
def test_rapid_numbers_stay_where_people_keep_them(tmp_path, user, work, changed):
    """A user frame that is nothing stays nothing, and so does an object frame; where both are something the part is off."""
    here, nothing = "[[600,0,500],[1,0,0,0]]", "[[0,0,0],[1,0,0,0]]"
    turned = "[[1000,0,500],[0.707106781186548,0,0,0.707106781186548]]"
    there = "[[400,0,0],[0.707106781186548,0,0,0.707106781186548]]"
    frames = (here, there) if user and work else (turned, nothing) if user else (nothing, turned)
    files = rapid()
    path = "RAPID/TASK1/SYSMOD/Frames.sys"
    files[path] = files[path].replace(f"{turned},{nothing}", ",".join(frames))
    points, done = both(tmp_path, files, "--keep-config")
    new = rapid_datum(done.folder, "wDoor")
    assert (new[:7] == pytest.approx(numbers(frames[0]), abs=1e-9)) == (changed == "oframe")
    assert (new[7:] == pytest.approx(numbers(frames[1]), abs=1e-9)) == (changed == "uframe")
    for name in SPOTS:
        assert rapid_flange(done.folder, name) == pytest.approx(rapid_flange(points.folder, name), abs=1e-3)


def test_krl_a_held_part_is_a_tool_to_the_controller(tmp_path):
    """P' = D P becomes TOOL' = TOOL D, for the part frame is the tool (DESIGN section 5, external TCP)."""
    points, frames = both(tmp_path, krl_held_part())
    assert depths(frames) == {"TOOL_DATA[1]": "tool"}
    gun = krl_frame(frames.folder, "BASE_DATA[3]")
    for name in SPOTS:
        there = [krl_frame(done.folder, "TOOL_DATA[1]") @ krl_pose(done.folder, name) for done in (points, frames)]
        flanges = [gun @ np.linalg.inv(pose) for pose in there]
        assert flanges[1] == pytest.approx(flanges[0], abs=1e-3)


def test_rapid_a_held_part_is_a_work_object(tmp_path):
    points, frames = both(tmp_path, rapid_held_part(), "--keep-config")
    assert depths(frames) == {"wPart": "base"}
    for name in SPOTS:
        there = [rapid_datum(done.folder, "wPart") for done in (points, frames)]
        poses = [
            from_abb(*w[:7]) @ from_abb(*w[7:14]) @ from_abb(*rapid_datum(done.folder, name)[:7])
            for w, done in zip(there, (points, frames), strict=True)
        ]
        assert poses[1] == pytest.approx(poses[0], abs=1e-3)


def random_frames(files: dict[str, str], dice: np.random.Generator) -> dict[str, str]:
    """The same programs under other bases and tools, of both languages."""

    def krl_members() -> str:
        values = [
            *dice.uniform(-1500, 1500, 3),
            dice.uniform(-180, 180),
            dice.uniform(-80, 80),
            dice.uniform(-180, 180),
        ]
        return ",".join(f"{name} {value:.3f}" for name, value in zip("XYZABC", values, strict=True))

    def rapid_pose() -> str:
        quaternion = dice.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        place = ",".join(f"{value:.2f}" for value in dice.uniform(-1500, 1500, 3))
        return f"[[{place}],[{','.join(f'{value:.9f}' for value in quaternion)}]]"

    made = {}
    for path, text in files.items():
        text = re.sub(
            r"^((?:BASE|TOOL)_DATA\[1\]=)\{.*?\}", lambda match: f"{match[1]}{{{krl_members()}}}", text, flags=re.M
        )
        text = re.sub(r"(tGun:=\[TRUE,)\[\[.*?\]\]", lambda match: match[1] + rapid_pose(), text)
        text = re.sub(
            r'(wDoor:=\[FALSE,TRUE,"",).*(\];)',
            lambda match: f"{match[1]}{rapid_pose()},{rapid_pose()}{match[2]}",
            text,
        )
        made[path] = text
    return made


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32), language=st.sampled_from(["krl", "rapid"]))
def test_the_law_of_depth(seed, language, tmp_path_factory):
    """Whatever bases and tools are, frames and points take the flange to the same places."""
    dice = np.random.default_rng(seed)
    files = random_frames(krl() if language == "krl" else rapid(), dice)
    points, frames = both(tmp_path_factory.mktemp("law"), files, "--keep-config", "--max-shift", "5000,180")
    assert set(depths(frames).values()) == {"base"}
    flange = krl_flange if language == "krl" else rapid_flange
    for name in SPOTS:
        one, other = flange(points.folder, name), flange(frames.folder, name)
        assert other[:3, 3] == pytest.approx(one[:3, 3], abs=6e-3)  # digits of the points, over a tool of 2 m
        assert other[:3, :3] == pytest.approx(one[:3, :3], abs=3e-6)


# ----------------------------------------------------------------------------------------------- frames that are left alone


def stays_alone(tmp_path: Path, files: dict[str, str], words: str, *options: str) -> Converted:
    """The base is left alone for a reason, and the points are what they are without ``--apply frames``."""
    points, frames = both(tmp_path, files, *options)
    assert words in kept(frames)
    assert set(depths(frames).values()) == {"point"}
    for path in points.folder.rglob("*"):
        if path.suffix in (".dat", ".src", ".mod", ".sys"):
            assert (frames.folder / path.relative_to(points.folder)).read_bytes() == path.read_bytes()
    return frames


def test_krl_a_base_that_a_program_outside_the_scope_uses_is_left_alone(tmp_path):
    other = {
        "rack.src": "DEF rack( )\n" + lin("R1") + "END\n",
        "rack.dat": "DEFDAT RACK\n" + krl_point("R1", 1, 2, 3) + fdat("R1") + "ENDDAT\n",
    }
    stays_alone(tmp_path, krl(more=other), "XR1 in rack uses it too and stays where it is")


def test_krl_a_base_that_code_reads_is_left_alone(tmp_path):
    other = {"calc.src": "DEF calc( )\nDECL REAL away\naway=BASE_DATA[1].X\nEND\n"}
    stays_alone(tmp_path, krl(more=other), "code reads it (KRC/R1/Program/calc.src:3)")


def test_krl_a_base_that_code_may_read_by_a_computed_number_is_left_alone(tmp_path):
    other = {"calc.src": "DEF calc( )\nDECL FRAME here\nDECL INT n\nhere=BASE_DATA[n]\nEND\n"}
    stays_alone(tmp_path, krl(more=other), "code reads it (KRC/R1/Program/calc.src:4)")


def test_krl_taking_the_base_by_its_name_is_what_it_is_there_for(tmp_path):
    other = {"take.src": "DEF take( )\n$BASE=BASE_DATA[1]\nEND\n"}
    done = convert(tmp_path, krl(more=other), *FRAMES)
    assert depths(done) == {"BASE_DATA[1]": "base"}


def test_krl_a_base_that_another_one_is_made_of_is_left_alone(tmp_path):
    body = "$BASE=BASE_DATA[1]:{X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\n"
    stays_alone(tmp_path, krl(body=body), "is made of it")


def test_krl_the_world_is_left_alone(tmp_path):
    files = krl()
    path = "KRC/R1/Program/weld.dat"
    files[path] = files[path].replace("BASE_NO 1", "BASE_NO 0")
    stays_alone(tmp_path, files, "it is the world")


def test_rapid_a_work_object_of_several_tasks_is_left_alone(tmp_path):
    files = rapid()
    other = DATA.split("\n")[3].strip()
    files["RAPID/TASK2/PROGMOD/Other.mod"] = f"MODULE Other\n  {other}\n  PROC main()\n  ENDPROC\nENDMODULE\n"
    stays_alone(tmp_path, files, "its numbers stand in no single place of the backup", "--keep-config")


def test_rapid_a_work_object_that_code_reads_is_left_alone(tmp_path):
    after = "  PROC rLook()\n    pLook:=CRobT(\\Tool:=tGun\\WObj:=wDoor);\n  ENDPROC\n"
    data = f"  PERS robtarget pLook:={robtarget(1, 2, 3)};\n"
    stays_alone(tmp_path, rapid(after=after, data=data), "code reads it (RAPID/TASK1/PROGMOD/Weld.mod", "--keep-config")


def test_a_refused_program_keeps_the_base_and_all_programs_that_use_it(tmp_path):
    """The base would take the targets of the refused program along."""
    other = {
        "more.src": "DEF more( )\n" + lin("R1") + "UNKNOWNTHING %%\n" + lin("S1", operand="XM1") + "END\n",
        "more.dat": "DEFDAT MORE\n"
        + krl_point("R1", 1, 2, 3)
        + fdat("R1")
        + krl_point("M1", 4, 5, 6)
        + fdat("S1")
        + "ENDDAT\n",
    }
    done = convert(tmp_path, krl(body="more( )\n", more=other), *FRAMES)
    assert done.code == 1
    assert not done.record["edits"]


def test_partial_is_refused_with_frames(tmp_path):
    done = convert(tmp_path, krl(), *FRAMES, "--partial")
    assert (done.code, done.record) == (2, {})
    assert "--partial" in done.err


# ---------------------------------------------------------------------------------------------------------------- tools


@pytest.fixture(scope="module", params=[KUKA, ABB])
def wrong_tool(request, tmp_path_factory):
    """Compensate a line whose tool is wrong at both depths."""
    folder = tmp_path_factory.mktemp("plant")
    plant = cell(folder / "line", request.param, "tool_offset", seed=1)
    made = plant.convert(folder / "points", ("tool_offset",))
    made.calibration.save(folder / "cal.json")
    plant.convert(folder / "frames", ("tool_offset",), apply="frames")
    return plant, folder


def flange_of(folder: Path, name: str) -> np.ndarray:
    if list(folder.rglob("$config.dat")):
        (path,) = [path for path in folder.rglob("*.dat") if f"X{name}=" in path.read_text("latin-1")]
        base, tool = krl_frame(folder, "BASE_DATA[1]"), krl_frame(folder, "TOOL_DATA[1]")
        return base @ krl_pose(folder, name, path.name) @ np.linalg.inv(tool)
    return rapid_flange(folder, name, "wobjBody", "tWeldGun1")


def test_a_tool_error_goes_into_the_tool_and_points_keep_their_numbers(wrong_tool):
    plant, folder = wrong_tool
    edits = json.loads((folder / "frames/respot.json").read_bytes())["edits"]
    assert sorted(edit["depth"] for edit in edits) == ["base", "tool"]
    for name in plant.line.ids[:20]:
        assert flange_of(folder / "frames", name) == pytest.approx(flange_of(folder / "points", name), abs=2e-3)
        assert np.linalg.norm((flange_of(folder / "frames", name) - flange_of(plant.backup, name))[:3, 3]) > 0.3


def test_the_way_back_restores_tool_and_base(wrong_tool, tmp_path):
    plant, folder = wrong_tool
    plant.convert(
        tmp_path / "back", (), source=folder / "frames", calibration=folder / "cal.json", inverse=True, apply="frames"
    )
    for path in (path for path in plant.backup.rglob("*") if path.suffix in (".dat", ".src", ".mod", ".sys")):
        old = path.read_text("latin-1").splitlines()
        new = (tmp_path / "back" / path.relative_to(plant.backup)).read_text("latin-1").splitlines()
        new = [line for line in new if "respot: " not in line]
        assert len(old) == len(new)
        for one, other in zip(old, new, strict=True):
            assert re.sub(NUMBER, "#", one) == re.sub(NUMBER, "#", other)
            assert numbers(one) == pytest.approx(numbers(other), abs=1.1e-6)


@pytest.mark.parametrize(
    ("written", "asked", "words"),
    [("frames", (), "add --apply frames"), ("points", FRAMES, "leave --apply frames out")],
)
def test_a_tool_offset_is_taken_out_of_where_it_was_written(wrong_tool, tmp_path, written, asked, words):
    _, folder = wrong_tool
    arguments = [
        "convert",
        str(folder / written),
        "-c",
        str(folder / "cal.json"),
        "--inverse",
        "-o",
        str(tmp_path / "out"),
        *asked,
    ]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert not (tmp_path / "out").exists()


def theory_with_tool(tmp_path: Path) -> Path:
    made = Calibration(TURN, np.asarray(SHIFT, dtype=float), "theory", "same", tuple(SPOTS))
    made = replace(made, tool_offset=np.array([1.0, 2.0, -3.0]))
    (tmp_path / "tool.json").write_text(made.to_json())
    return tmp_path / "tool.json"


def aligned(tmp_path: Path, *options: str) -> tuple[int, dict, str, Path]:
    backup = tmp_path / "backup"
    for path, text in krl().items():
        (backup / path).parent.mkdir(parents=True, exist_ok=True)
        (backup / path).write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    name = "_".join(options).replace("-", "") or "none"
    arguments = [
        "convert",
        str(backup),
        "-c",
        str(theory_with_tool(tmp_path)),
        "-o",
        str(tmp_path / name),
        "--force",
        "--json",
    ]
    result = CliRunner().invoke(app, [*arguments, *options])
    return result.exit_code, json.loads(result.stdout) if result.stdout else {}, result.stderr, tmp_path / name


def test_aligning_asks_where_a_tool_offset_goes(tmp_path):
    code, _, err, out = aligned(tmp_path)
    assert code == 2
    assert "--apply frames" in err and "--apply points" in err
    assert not out.exists()


def test_aligning_corrects_tool_and_points_or_points_alone(tmp_path):
    """T' = G P d in both; the tool's data become TOOL d, or are the simulation's own (DESIGN section 6, depth)."""
    motion, offset = np.eye(4), np.eye(4)
    motion[:3, :3], motion[:3, 3] = TURN, SHIFT
    offset[:3, 3] = [1.0, 2.0, -3.0]
    code, record, err, frames = aligned(tmp_path, *FRAMES)
    assert code == 0, err
    assert {edit["depth"] for edit in record["edits"]} == {"point", "base", "tool"}
    backup = tmp_path / "backup"
    for name in SPOTS:
        tip = krl_frame(backup, "BASE_DATA[1]") @ krl_pose(backup, name) @ offset
        assert krl_frame(frames, "BASE_DATA[1]") @ krl_pose(frames, name) == pytest.approx(motion @ tip, abs=2e-3)
    assert krl_frame(frames, "TOOL_DATA[1]") == pytest.approx(krl_frame(backup, "TOOL_DATA[1]") @ offset, abs=1e-6)
    code, record, err, points = aligned(tmp_path, "--apply", "points")
    assert code == 0, err
    for name in SPOTS:
        tip = krl_frame(backup, "BASE_DATA[1]") @ krl_pose(backup, name) @ offset
        assert krl_frame(points, "BASE_DATA[1]") @ krl_pose(points, name) == pytest.approx(motion @ tip, abs=2e-3)
    assert krl_frame(points, "TOOL_DATA[1]") == pytest.approx(krl_frame(backup, "TOOL_DATA[1]"), abs=1e-12)
    assert any("bring its own tool" in issue["message"] for issue in record["issues"])


def test_a_tool_that_nobody_knows_is_not_corrected(tmp_path, monkeypatch):
    """Where the program computes the number of the tool, no frame is there to change: the points say what they say."""
    files = krl()
    path = "KRC/R1/Program/weld.src"
    changed = re.sub(r"(FDAT_ACT=FS\d\n)", r"\1FDAT_ACT.TOOL_NO=which\n", files[path])
    assert changed != files[path]
    monkeypatch.setitem(globals(), "krl", lambda: {**files, path: changed})
    code, record, err, _ = aligned(tmp_path, *FRAMES, "--keep-config")
    assert code == 0, err
    assert "tool" not in {edit["depth"] for edit in record["edits"]}
