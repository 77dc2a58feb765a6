"""`convert --snap`: welds exactly onto their theoretical positions, the path between blended; and what refuses it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from tests.correction.small import DATA, SPOTS, fdat, krl, krl_in_base1, krl_point, lin, moved, rapid, robtarget

MORE = {"S5": (1500, 400, 650), "S6": (1100, 900, 400), "S7": (1600, 800, 700), "S8": (900, 500, 800)}
WELDS = {**SPOTS, **MORE}
#: What the theory asks beyond the rigid motion: the rigid fit takes little of it.
RESIDUALS = dict(zip(WELDS, np.random.default_rng(4).normal(scale=1.0, size=(8, 3)), strict=True))
GOLDEN = Path(__file__).parent / "golden_snap"


def theory(folder: Path, residuals=RESIDUALS, names=WELDS, file: str = "theory.csv") -> Path:
    rows = [f"{name},{','.join(f'{v:.4f}' for v in moved(WELDS[name]) + residuals[name])}" for name in names]
    (folder / file).write_text("\n".join(["id,x,y,z", *rows]) + "\n")
    return folder / file


def krl_line(body: str = "", data: str = "", after: str = "", **more) -> dict[str, str]:
    """All eight spots; behind S4 the path leaves by 50 mm and comes to S5 from 50 mm away."""
    own = lin("R4") + lin("M") + lin("A5") + "".join(lin(name, weld=True) for name in MORE) + body
    points = {**MORE, "R4": (1200, 300, 950), "M": (1350, 350, 1000), "A5": (1500, 400, 700)}
    declared = "".join(krl_point(name, *krl_in_base1(place)) + fdat(name) for name, place in points.items())
    return krl(own, declared + data, after, **more)


def rapid_line(body: str = "", data: str = "", after: str = "", **more) -> dict[str, str]:
    points = {**MORE, "R4": (1200, 300, 950), "M": (1350, 350, 1000), "A5": (1500, 400, 700)}
    declared = "".join(f"  CONST robtarget {name}:={robtarget(*krl_in_base1(p))};\n" for name, p in points.items())
    way = "".join(f"    MoveL {name},v800,z10,tGun\\WObj:=wDoor;\n" for name in ("R4", "M", "A5"))
    way += "".join(f"    SpotL {name},v800,gun1,sd1,tGun\\WObj:=wDoor;\n" for name in MORE)
    return rapid(way + body, declared + data, after, **more)


class Done:
    """What a conversion wrote, and the world poses of its targets as this test reads them."""

    def __init__(self, result, folder: Path) -> None:
        self.code, self.err, self.out, self.folder = result.exit_code, result.stderr, result.stdout, folder
        self.record = json.loads(result.stdout) if result.stdout.startswith("{") else {}

    def files(self) -> dict[str, bytes]:
        return {
            str(path.relative_to(self.folder)): path.read_bytes()
            for path in self.folder.rglob("*")
            if path.is_file() and path.name != "respot.json"
        }

    def world(self, name: str) -> np.ndarray:
        """Point of a target under base 1, turned by 90 degrees about z."""
        text = b"".join(self.files().values()).decode("latin-1")
        found = re.search(rf"X{name}=\{{X ([-\d.]+),Y ([-\d.]+),Z ([-\d.]+)", text)
        found = found or re.search(rf"robtarget {name}:=\[\[([-\d.]+),([-\d.]+),([-\d.]+)\]", text)
        assert found is not None, name
        x, y, z = map(float, found.groups())
        return np.array([1000.0 - y, x, 500.0 + z])

    @property
    def codes(self) -> set[str]:
        return {issue["code"] for issue in self.record["issues"]}

    @property
    def rotation(self) -> np.ndarray:
        return np.array(self.record["fit"]["transform"]["rotation"])

    def rigid(self, place) -> np.ndarray:
        return self.rotation @ np.asarray(place, dtype=float) + self.record["fit"]["transform"]["translation"]


def convert(folder: Path, files: dict[str, str], *options: object, reference=None, snap=True, name="out") -> Done:
    backup = folder / "backup"
    for path, text in files.items():
        (backup / path).parent.mkdir(parents=True, exist_ok=True)
        (backup / path).write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    listed = reference or theory(folder)
    more = ["--snap"] if snap else []
    arguments = ["convert", backup, "--theory", listed, "-o", folder / name, "--json", "--keep-config", *more, *options]
    return Done(CliRunner().invoke(app, [str(argument) for argument in arguments]), folder / name)


@pytest.fixture(params=["krl", "rapid"])
def line(request):
    return {"krl": krl_line, "rapid": rapid_line}[request.param]


def test_welds_stand_where_the_list_says_to_the_last_digit(tmp_path, line):
    done = convert(tmp_path, line())
    assert done.code == 0, done.err
    for name, place in WELDS.items():
        wanted = np.round(moved(place) + RESIDUALS[name], 4)
        assert np.abs(done.world(name) - wanted).max() < 0.5e-4 + 1e-9
    snap = done.record["snap"]
    assert snap["spots"] == 8
    sizes = {name: np.linalg.norm(done.world(name) - done.rigid(place)) for name, place in WELDS.items()}
    assert snap["at"] == max(sizes, key=lambda name: sizes[name])
    assert snap["largest_mm"] == pytest.approx(max(sizes.values()), abs=1e-3)
    assert "SNAPPED" in done.codes


def test_what_of_each_shift_is_snap(tmp_path, line):
    done = convert(tmp_path, line())
    for edit in done.record["edits"]:
        name = edit["target"].removeprefix("X")
        place = WELDS.get(name)
        if place is not None:
            assert edit["snap_mm"] == pytest.approx(np.linalg.norm(done.world(name) - done.rigid(place)), abs=1e-3)
    assert len([edit for edit in done.record["edits"] if edit["snap_mm"] > 0.0]) == 11


def test_approach_and_retract_keep_their_way_to_the_weld(tmp_path, line):
    done = convert(tmp_path, line())
    for point, weld in (("R4", "S4"), ("A5", "S5")):
        offset = np.array({"R4": (0, 0, 50), "A5": (0, 0, 50)}[point], dtype=float)
        np.testing.assert_allclose(done.world(point) - done.world(weld), done.rotation @ offset, atol=2e-4)


def test_between_two_welds_the_shift_lies_between_theirs(tmp_path, line):
    done = convert(tmp_path, line())
    shift = done.world("M") - done.rigid((1350, 350, 1000))
    ends = [done.world(name) - done.rigid(WELDS[name]) for name in ("S4", "S5")]
    # on the straight line between both, and on neither end
    along = (shift - ends[0]) @ (ends[1] - ends[0]) / np.sum((ends[1] - ends[0]) ** 2)
    assert 0.01 < along < 0.99
    np.testing.assert_allclose(shift, ends[0] + along * (ends[1] - ends[0]), atol=2e-4)


def test_orientations_are_those_of_the_rigid_image(tmp_path, line):
    snapped = convert(tmp_path, line())
    rigid = convert(tmp_path, line(), snap=False, name="rigid")
    kept = re.compile(rb"A [-\d.]+,B [-\d.]+,C [-\d.]+|\],\[[-\d.]+,[-\d.]+,[-\d.]+,[-\d.]+\]")
    for path, data in rigid.files().items():
        assert kept.findall(data) == kept.findall(snapped.files()[path])
    assert rigid.record["edits"]
    assert all("snap_mm" not in edit for edit in rigid.record["edits"])
    assert "snap" not in rigid.record


def test_without_residuals_the_rigid_image_comes_out(tmp_path, line):
    # the list is printed to 0.1 um
    exact = theory(tmp_path, dict.fromkeys(WELDS, np.zeros(3)))
    snapped = convert(tmp_path, line(), "--effects", "none", reference=exact)
    rigid = convert(tmp_path, line(), "--effects", "none", reference=exact, snap=False, name="rigid")
    assert snapped.code == rigid.code == 0
    for name in (*WELDS, "R4", "M", "A5"):
        np.testing.assert_allclose(snapped.world(name), rigid.world(name), atol=2e-4)


def test_the_terminal_says_how_many_and_warns(tmp_path):
    for path, text in krl_line().items():
        (tmp_path / "backup" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "backup" / path).write_text(text)
    command = ["convert", tmp_path / "backup", "--theory", theory(tmp_path), "--snap", "--dry-run"]
    result = CliRunner().invoke(app, [str(word) for word in command])
    assert "8 welds snapped onto their theoretical positions" in result.stdout
    assert "no longer move as one body" in result.stderr


# --- paths


def test_offsets_from_a_weld_follow_the_path(tmp_path):
    """The approach keeps its numbers but for the turn; what lies beyond S8 on the way back to S5 is in between."""
    way = "    MoveL Offs(S8,0,0,-50),v800,z10,tGun\\WObj:=wDoor;\n"
    way += "    MoveL Offs(S8,-100,-350,0),v800,z10,tGun\\WObj:=wDoor;\n"
    way += "    SpotL S5,v800,gun1,sd1,tGun\\WObj:=wDoor;\n"
    done = convert(tmp_path, rapid_line(way))
    assert done.code == 0, done.err
    text = done.files()["RAPID/TASK1/PROGMOD/Weld.mod"].decode()
    offsets = [np.array([float(v) for v in found]) for found in re.findall(r"Offs\(S8,([^,]+),([^,]+),([^)]+)\)", text)]
    base = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = base.T @ done.rotation @ base
    np.testing.assert_allclose(offsets[0], turned @ [0.0, 0.0, -50.0], atol=2e-3)
    old = np.array(WELDS["S8"]) + base @ [-100.0, -350.0, 0.0]
    shift = done.world("S8") + base @ offsets[1] - done.rigid(old)
    ends = [done.world(name) - done.rigid(WELDS[name]) for name in ("S8", "S5")]
    along = (shift - ends[0]) @ (ends[1] - ends[0]) / np.sum((ends[1] - ends[0]) ** 2)
    assert 0.01 < along < 0.99
    np.testing.assert_allclose(shift, ends[0] + along * (ends[1] - ends[0]), atol=5e-3)


def test_a_point_far_from_all_welds_that_two_ways_lead_to_gets_their_mean(tmp_path):
    """Where the program begins and ends."""
    point = krl_point("P0", *krl_in_base1((1200, -400, 1100))) + fdat("P0")
    files = krl_line(lin("P0"), point)
    path = next(path for path in files if path.endswith("weld.src"))
    files[path] = files[path].replace("DEF weld( )\n", "DEF weld( )\n" + lin("P0"))
    done = convert(tmp_path, files)
    assert done.code == 0, done.err
    ends = [done.world(name) - done.rigid(WELDS[name]) for name in ("S1", "S8")]
    np.testing.assert_allclose(done.world("P0") - done.rigid((1200, -400, 1100)), np.mean(ends, axis=0), atol=2e-4)
    assert done.record["snap"]["met_by_several_ways"] == 1


def test_a_way_to_two_welds_is_refused(tmp_path):
    """The same point right before S5 and right before S6, which are 40 mm apart."""
    place = (1500, 430, 650)
    body = lin("W") + lin("S5", weld=True) + lin("M") + lin("W") + lin("S9", weld=True)
    names = {**WELDS, "S9": place}
    data = krl_point("W", *krl_in_base1((1500, 415, 700))) + fdat("W")
    data += krl_point("S9", *krl_in_base1(place)) + fdat("S9")
    listed = theory(tmp_path)
    with listed.open("a") as file:
        file.write("S9," + ",".join(f"{v:.4f}" for v in moved(names["S9"]) + [0.3, -1.2, 0.8]) + "\n")
    done = convert(tmp_path, krl_line(body, data), reference=listed)
    assert done.code == 1
    assert ("weld", "XW", "SHARED_TARGET") in {
        (item["program"], item["target"], item["code"]) for item in done.record["refused"]
    }
    assert not done.record["edits"]


def test_an_approach_in_a_routine_of_its_own_follows_the_weld_of_its_caller(tmp_path):
    point = krl_point("G", *krl_in_base1((900, 500, 860))) + fdat("G")
    files = krl_line("GOTO8( )\n" + lin("S8", weld=True), point, "DEF GOTO8( )\n" + lin("G") + "END\n")
    done = convert(tmp_path, files)
    assert done.code == 0, done.err
    np.testing.assert_allclose(done.world("G") - done.world("S8"), done.rotation @ [0.0, 0.0, 60.0], atol=2e-4)


def test_the_part_on_the_robot_is_snapped_in_its_own_frame(tmp_path):
    """With a fixed gun the targets are seen from the part, and the list is in the part."""
    lines = "MODULE Weld\n" + "".join(f"  CONST robtarget {name}:={robtarget(*p)};\n" for name, p in WELDS.items())
    lines += "  PROC rWeld()\n"
    lines += "".join(f"    SpotL {name},v800,gun1,sd1,tFixed\\WObj:=wPart;\n" for name in WELDS)
    files = {
        "RAPID/TASK1/PROGMOD/Weld.mod": lines + "  ENDPROC\nENDMODULE\n",
        "RAPID/TASK1/SYSMOD/Frames.sys": DATA,
    }
    done = convert(tmp_path, files)
    assert done.code == 0, done.err
    for name, place in WELDS.items():
        x, y, z = done.world(name) - [1000.0, 0.0, 500.0]
        assert np.abs(np.array([y, -x, z]) - np.round(moved(place) + RESIDUALS[name], 4)).max() < 0.5e-4 + 1e-9


# --- refusals


def test_a_weld_that_the_list_lacks_leaves_its_program_as_it_was(tmp_path, line):
    done = convert(tmp_path, line(), reference=theory(tmp_path, names=[name for name in WELDS if name != "S6"]))
    assert done.code == 1
    (refusal,) = done.record["refused"]
    assert refusal["code"] == "SNAP_UNRESOLVED"
    assert refusal["target"].endswith("S6")
    assert not done.record["edits"]


def test_several_spots_beside_one_target_are_not_taken_for_each_other(tmp_path):
    """Offsets from one target weld S9 and S10, 12 mm apart: no residual of one may go into the other."""
    places = {"S9": (930, 500, 800), "S10": (942, 500, 800)}
    shifts = {"S9": (0, -30, 0), "S10": (0, -42, 0)}
    way = "".join(
        f"    SpotL Offs(P8,{x},{y},{z}),v800,gun1,sd{name},tGun\\WObj:=wDoor;\n" for name, (x, y, z) in shifts.items()
    )
    point = f"  CONST robtarget P8:={robtarget(*krl_in_base1(WELDS['S8']))};\n"
    point += "".join(f"  PERS spotdata sd{name}:=[1,2000,1,0];\n" for name in (*WELDS, *places))
    files = rapid_line(way, point)
    path = next(path for path in files if path.endswith("Weld.mod"))
    files[path] = re.sub(r"SpotL (S\d),v800,gun1,sd1", r"SpotL \1,v800,gun1,sd\1", files[path])
    listed = theory(tmp_path)
    with listed.open("a") as file:
        for name, place in places.items():
            file.write(f"{name}," + ",".join(f"{v:.4f}" for v in moved(place)) + "\n")
    done = convert(tmp_path, files, "--spot-id", r"sd(S\d+)", reference=listed)
    assert done.record["fit"]["n_matched"] == 10
    assert done.code == 1
    assert {(item["target"], item["code"]) for item in done.record["refused"]} == {("P8", "SNAP_UNRESOLVED")}
    assert not done.record["edits"]


def refused(done: Done, *words: str) -> None:
    assert done.code == 2, done.out
    assert not done.folder.exists()
    for word in words:
        assert word in done.err


def test_an_outlier_is_no_settled_name(tmp_path):
    far = {**RESIDUALS, "S3": np.array([0.0, 14.0, 0.0])}
    refused(convert(tmp_path, krl_line(), reference=theory(tmp_path, far)), "SNAP_UNRESOLVED", "OUTLIER", "S3")


def test_a_spot_that_was_renamed_is_no_settled_name(tmp_path):
    listed = theory(tmp_path)
    listed.write_text(listed.read_text().replace("S7,", "Q7,"))
    refused(convert(tmp_path, krl_line(), reference=listed), "SNAP_UNRESOLVED", "PROBABLY_RENAMED", "Q7")


def test_a_weld_that_would_go_too_far(tmp_path, line):
    done = convert(tmp_path, line(), "--max-residual", "1.2")
    assert done.code == 1
    assert {item["code"] for item in done.record["refused"]} == {"RESIDUAL_TOO_LARGE"}
    assert not done.record["edits"]


@pytest.mark.parametrize(
    ("options", "word"), [(["--inverse"], "--inverse"), (["--apply", "frames"], "frames"), (["--partial"], "whole")]
)
def test_what_it_cannot_be_joined_with(tmp_path, options, word):
    refused(convert(tmp_path, krl_line(), *options), "--snap", word)


@pytest.mark.parametrize("record", ["kept", "lost"])
def test_it_is_not_turned_back(tmp_path, record):
    """The robot hands programs back without our record: their headers must tell it too."""
    done = convert(tmp_path, krl_line())
    backup, saved = tmp_path / "backup", tmp_path / "c.json"
    run = CliRunner()
    fit = ["fit", str(backup), "--theory", str(tmp_path / "theory.csv"), "-o", str(saved)]
    assert run.invoke(app, fit).exit_code == 0
    if record == "lost":
        (done.folder / "respot.json").unlink()
    back = ["convert", str(done.folder), "-c", str(saved), "--inverse", "-o", str(tmp_path / "back"), "--force"]
    result = run.invoke(app, back)
    assert result.exit_code == 2
    assert "snapped" in result.stderr
    assert not (tmp_path / "back").exists()


def test_it_needs_the_list_itself(tmp_path):
    convert(tmp_path, krl_line())
    listed = tmp_path / "theory.csv"
    backup = tmp_path / "backup"
    run = CliRunner()
    assert run.invoke(app, ["fit", str(backup), "--theory", str(listed), "-o", str(tmp_path / "c.json")]).exit_code == 0
    for reference in (["-c", str(tmp_path / "c.json")], ["--measured", str(listed), "--effects", "none"]):
        result = run.invoke(app, ["convert", str(backup), *reference, "--snap", "-o", str(tmp_path / "no")])
        assert result.exit_code == 2
        assert "--theory" in result.stderr


# --- the bytes


@pytest.mark.parametrize(
    ("make", "file"),
    [(krl_line, "KRC/R1/Program/weld.dat"), (rapid_line, "RAPID/TASK1/PROGMOD/Weld.mod")],
    ids=["krl", "rapid"],
)
def test_golden(tmp_path, make, file):
    done = convert(tmp_path, make())
    lines = [text for text in done.files()[file].decode("latin-1").splitlines() if "respot: " not in text]
    stored = GOLDEN / Path(file).name
    assert "\n".join(lines) + "\n" == stored.read_text()
