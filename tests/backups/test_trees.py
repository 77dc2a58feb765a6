"""Where the controllers of a tree are: every layout, any case, any folders around it; copies are not live."""

from __future__ import annotations

import pytest

from respot.backups import open_backup
from respot.issues import BadInputError
from tests.backups.trees import (
    CONFIG,
    MACHINE,
    MULTIMOVE,
    am_ini,
    backinfo,
    krc,
    module,
    packed,
    src,
    system_xml,
    write,
)


def found(path) -> list[tuple[str, str, str]]:
    return sorted((robot.name, robot.language, robot.root) for robot in open_backup(path).robots)


def codes(path) -> set[str]:
    backup = open_backup(path)
    return {issue.code for issue in [*backup.issues, *(issue for robot in backup.robots for issue in robot.issues)]}


LAYOUTS = {
    "krc": ({"KRC/R1/Program/a.src": src("a")}, "krl"),
    "krc_in_lower_case": ({"krc/r1/program/A.SRC": src("a")}, "krl"),
    "krc_in_upper_case": ({"KRC/R1/PROGRAM/A.SRC": src("a")}, "krl"),
    "krc2_with_steu": ({"KRC/R1/a.src": src("a"), "KRC/STEU/$config.dat": CONFIG}, "krl"),
    "vkrc": ({"KRC/R1/Folgen/FOLGE1.src": src("FOLGE1"), "KRC/R1/UPs/UP1.src": src("UP1")}, "krl"),
    "bare_vkrc": ({"R1/Makros/MAKRO1.src": src("MAKRO1")}, "krl"),
    "bare_r1_with_steu": ({"R1/Program/a.src": src("a"), "STEU/$config.dat": CONFIG}, "krl"),
    "irc5": ({"RAPID/TASK1/PROGMOD/A.mod": module("A")}, "rapid"),
    "irc5_in_lower_case": ({"rapid/task1/progmod/a.mod": module("A")}, "rapid"),
    "omnicore": ({"RAPID/TASK1/PROGMOD/A.modx": module("A")}, "rapid"),
    "s4c_task_without_rapid": ({"TASK1/SYSMOD/A.sys": module("A")}, "rapid"),
    "s4c_task_around_rapid": ({"TASK0/RAPID/A.mod": module("A")}, "rapid"),
    "rapid_without_tasks": ({"RAPID/PROGMOD/A.mod": module("A")}, "rapid"),
    "rapid_with_loose_modules": ({"RAPID/A.mod": module("A")}, "rapid"),
    "tasks_under_their_names": ({"RAPID/T_ROB1/A.mod": module("A")}, "rapid"),
}


@pytest.mark.parametrize("around", ["", "020R01/", "line 2/Backups/RAPID/020R01/", "R1/", "krc_backups/home/"])
@pytest.mark.parametrize("name", LAYOUTS)
def test_layout(tmp_path, name, around):
    files, language = LAYOUTS[name]
    folder = write(tmp_path / "all", {f"{around}{path}": text for path, text in files.items()})
    last = around.rstrip("/").rpartition("/")[2] or "all"
    assert found(folder) == [(last, language, around)]
    (robot,) = open_backup(folder).robots
    assert len(list(robot.moves())) == sum(path.lower().endswith((".src", ".mod", ".modx", ".sys")) for path in files)
    assert "NOT_LIVE" not in codes(folder)


def test_several_robots_anywhere_in_one_tree(tmp_path):
    files = {
        **krc("ST20R01", "line/020R01/"),
        **krc("ST20R02", "line/new/020R02/"),
        "line/020R03/RAPID/TASK1/PROGMOD/A.mod": module("A"),
        "line/020R03/system.xml": system_xml("ST20R03"),
    }
    expected = [
        ("ST20R01", "krl", "line/020R01/"),
        ("ST20R02", "krl", "line/new/020R02/"),
        ("ST20R03", "rapid", "line/020R03/"),
    ]
    folder, archive = write(tmp_path / "all", files), packed(tmp_path / "all.zip", files)
    assert found(folder) == found(archive) == expected
    backup = open_backup(folder)
    own = backup.files_of(backup.robot("st20r03"))
    assert sorted(own) == ["line/020R03/RAPID/TASK1/PROGMOD/A.mod", "line/020R03/system.xml"]


def test_a_robot_is_asked_for_by_name_in_any_case(respot, tmp_path):
    write(tmp_path / "all", {**krc("ST20R01", "a/"), **krc("ST20R02", "b/")})
    result = respot("convert", "all", "--theory", "nowhere.csv", "-o", "out")
    assert result.code == 2
    (tmp_path / "theory.csv").write_text("id,x,y,z\nS1,0,0,0\n")
    for command in (
        ["fit", "all", "--theory", "theory.csv"],
        ["convert", "all", "--theory", "theory.csv", "-o", "out"],
    ):
        result = respot(*command)
        assert result.code == 2 and "SEVERAL_ROBOTS" in result.err, result.err
        assert "ST20R01, ST20R02" in result.err and "--robot-name" in result.err
        assert "SEVERAL_ROBOTS" not in respot(*command, "--robot-name", "st20r02").err
    result = respot("inspect", "all", "--robot-name", "St20R02", "--json")
    assert [robot["name"] for robot in result.json["robots"]] == ["ST20R02"]


def test_five_backups_of_one_controller_are_told_apart_by_their_folders(respot, tmp_path):
    files = {}
    for day in ("2025-12-18", "2026-01-13"):
        files |= {f"RAPID/{day}/RAPID/TASK1/PROGMOD/A.mod": module("A"), f"RAPID/{day}/system.xml": system_xml("SYS1")}
    folder = write(tmp_path / "all", files)
    assert [name for name, _, _ in found(folder)] == ["RAPID/2025-12-18", "RAPID/2026-01-13"]
    result = respot("inspect", "all", "--robot-name", "rapid/2026-01-13", "--json")
    assert [robot["name"] for robot in result.json["robots"]] == ["RAPID/2026-01-13"]


def test_two_languages_in_one_loose_folder(tmp_path):
    folder = write(tmp_path / "mixed", {"a.src": src("a"), "b.mod": module("b")})
    assert [name for name, _, _ in found(folder)] == ["mixed krl", "mixed rapid"]


def test_a_copy_on_the_drive_is_not_live(tmp_path):
    """`C/KRC/..` beside `KRC/..`: the module would count twice, with old points."""
    files = {**krc("ST20R01"), "C/KRC/ROBOTER/KRC/R1/Program/weld.src": src("weld", 999.0)}
    folder = write(tmp_path / "all", files)
    (robot,) = open_backup(folder).robots
    assert [move.target.number("X") for move in robot.moves()] == [100.0]
    (issue,) = [issue for issue in robot.issues if issue.code == "NOT_LIVE"]
    assert issue.path == "C/KRC/ROBOTER/KRC/R1/Program/weld.src"
    assert "C/KRC/ROBOTER/KRC/R1/Program/weld.src" in open_backup(folder).files_of(robot)


def test_a_copy_of_a_controllers_disk(tmp_path):
    files = {"020R01/C/KRC/ROBOTER/KRC/R1/Program/a.src": src("a"), "020R01/C/KRC/User/b.txt": "no program"}
    (robot,) = open_backup(write(tmp_path / "all", files)).robots
    assert (robot.name, robot.root, len(robot.files)) == ("020R01", "020R01/C/KRC/ROBOTER/", 1)


def test_robots_in_folders_named_like_drives(tmp_path):
    """Stations A to D: a letter above KRC is a drive only beside the KRC that it belongs to."""
    files = {path: text for letter in "ABCD" for path, text in krc(f"R{letter}", f"{letter}/").items()}
    assert [root for _, _, root in found(write(tmp_path / "all", files))] == ["A/", "B/", "C/", "D/"]


def test_copies_in_home_are_not_live(tmp_path):
    files = {
        "RAPID/TASK1/PROGMOD/A.mod": module("A", 600.0),
        "HOME/A.mod": module("A", 999.0),
        "PROGMOD/A.mod": module("A", 998.0),
    }
    folder = write(tmp_path / "all", files)
    (robot,) = open_backup(folder).robots
    assert [move.target.number("x") for move in robot.moves()] == [600.0]
    assert "NOT_LIVE" in codes(folder)


@pytest.mark.parametrize("inside", ["HOME/old/RAPID/TASK1/PROGMOD/", "HOME/KRC/R1/Program/", "CS/RAPID/TASK1/PROGMOD/"])
def test_a_backup_in_home_is_no_robot_and_stays_with_its_controller(tmp_path, inside):
    copy = f"SYS1/{inside}A.{'src' if 'KRC' in inside else 'mod'}"
    files = {"SYS1/RAPID/TASK1/PROGMOD/A.mod": module("A"), copy: src("A") if "KRC" in inside else module("A", 999.0)}
    folder = write(tmp_path / "all", files)
    backup = open_backup(folder)
    (robot,) = backup.robots
    assert sorted(backup.files_of(robot)) == sorted(files)
    assert len(list(robot.moves())) == 1


def test_home_on_the_way_to_a_backup_means_nothing(tmp_path):
    """A person's folder may be named HOME: only HOME of a controller holds copies."""
    folder = write(tmp_path / "all", {"home/line/A.mod": module("A"), "home/line/B.mod": module("B")})
    (robot,) = open_backup(folder / "home").robots
    assert len(list(robot.moves())) == 2


def test_a_loose_folder_of_modules_is_one_robot(tmp_path):
    files = {"welds/a.src": src("a"), "b.src": src("b"), "more/deep/c.src": src("c")}
    assert found(write(tmp_path / "loose.v2", files)) == [("loose.v2", "krl", "")]


def test_programs_that_belong_to_no_robot_are_named(tmp_path):
    backup = open_backup(write(tmp_path / "all", {**krc("ST20R01", "020R01/"), "extra/b.src": src("b")}))
    (issue,) = [issue for issue in backup.issues if issue.code == "NOT_IN_A_ROBOT"]
    assert "extra/b.src" in issue.message


def test_files_that_only_look_like_programs_make_no_robot(tmp_path):
    folder = write(tmp_path / "all", {"src/rapid/driver.sys": "not rapid", "tables/points.dat": "1;2;3\n4;5;6\n"})
    with pytest.raises(BadInputError, match="NO_ROBOT"):
        open_backup(folder).robot()


# ------------------------------------------------------------------------------------------------------- half a backup


@pytest.mark.parametrize(
    ("files", "missing"),
    [
        ({"Program/a.src": src("a"), "System/$config.dat": CONFIG}, {"$machine.dat"}),
        ({"Program/a.src": src("a"), "Mada/$machine.dat": MACHINE}, {"$config.dat"}),
        ({"Program/a.src": src("a")}, {"$config.dat", "$machine.dat"}),
        (krc("ST20R01"), set()),
        ({"RAPID/TASK1/PROGMOD/A.mod": module("A")}, {"moc.cfg", "backinfo.txt"}),
        (
            {"RAPID/TASK1/PROGMOD/A.mod": module("A"), "RAPID/TASK2/PROGMOD/B.mod": module("B")},
            {"moc.cfg", "sys.cfg", "backinfo.txt"},
        ),
        ({**MULTIMOVE, "SYSPAR/MOC.cfg": "", "HOME/moc.cfg": ""}, set()),
        ({k: v for k, v in MULTIMOVE.items() if "MOC" not in k} | {"HOME/moc.cfg": ""}, {"moc.cfg"}),
    ],
)
def test_half_a_backup_says_what_is_missing(tmp_path, files, missing):
    for robot in open_backup(write(tmp_path / "all", files)).robots:
        said = [issue.message for issue in robot.issues if issue.code == "HALF_BACKUP"]
        assert len(said) == bool(missing)
        every = {"$config.dat", "$machine.dat", "moc.cfg", "sys.cfg", "backinfo.txt"}
        assert {name for name in every if said and f"no {name}" in said[0]} == missing
        assert list(robot.moves())


def test_bare_folders_of_several_robots(tmp_path):
    """Only `System` and `Mada` with a controller's own files mark a root: `Program` is any folder's name."""
    files = {}
    for name in ("020R01", "020R02"):
        files |= {f"{name}/Program/a.src": src("a"), f"{name}/System/$config.dat": CONFIG}
    assert [root for _, _, root in found(write(tmp_path / "all", files))] == ["020R01/", "020R02/"]


def test_a_single_program_is_no_half_backup(tmp_path):
    write(tmp_path, {"weld.src": src("weld"), "weld.dat": "DEFDAT WELD\nENDDAT\n", "other.src": src("other")})
    backup = open_backup(tmp_path / "weld.src")
    assert sorted(backup.files) == ["weld.dat", "weld.src"]
    assert "HALF_BACKUP" not in [issue.code for issue in backup.robot().issues]


def test_a_backup_without_modules(respot, tmp_path):
    files = {"SYS1/BACKINFO/backinfo.txt": backinfo(), "SYS1/SYSPAR/MOC.cfg": "MOC:CFG_1.0:6:0::\n"}
    write(tmp_path / "empty", files)
    result = respot("inspect", "empty")
    assert result.code == 2 and len(result.err.strip().splitlines()) == 1
    assert "NO_ROBOT" in result.err and "SYS1" in result.err and "without modules" in result.err
    write(tmp_path / "empty", krc("ST20R01", "020R01/"))
    assert "HALF_BACKUP" in {issue.code for issue in open_backup(tmp_path / "empty").issues}


def test_a_backup_without_modules_given_by_its_own_folder(tmp_path):
    write(tmp_path / "SYS1", {"BACKINFO/backinfo.txt": backinfo(), "SYSPAR/MOC.cfg": "MOC:CFG_1.0:6:0::\n"})
    with pytest.raises(BadInputError, match="holds no robot program: SYSPAR and BACKINFO"):
        open_backup(tmp_path / "SYS1").robot()


def test_modules_that_backinfo_lists_and_the_backup_lacks(tmp_path):
    listed = backinfo("TASK1: (T_ROB1,P,)\nPROGMOD/A.mod @ \nPROGMOD/Gone.mod @ \nSYSMOD/LINKEDM.sys @ HIDDEN")
    files = {"BACKINFO/backinfo.txt": listed, "RAPID/TASK1/PROGMOD/a.MOD": module("A")}
    (robot,) = open_backup(write(tmp_path / "all", files)).robots
    (issue,) = [issue for issue in robot.issues if issue.code == "HALF_BACKUP" and "lacks" in issue.message]
    assert "Gone.mod" in issue.message and "A.mod" not in issue.message and "LINKEDM" not in issue.message
    assert issue.path == "BACKINFO/backinfo.txt"
    assert listed.splitlines()[issue.line - 1].startswith(">>TASK1:")


# ------------------------------------------------------------------------------------- what does not stop the rest


def test_a_zip_inside_a_zip_is_kept_and_named(tmp_path):
    inner = packed(tmp_path / "inner.zip", krc("INNER")).read_bytes()
    path = packed(tmp_path / "outer.zip", {**krc("OUTER"), "C/old.zip": ""})
    import zipfile

    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("C/inner.zip", inner)
    backup = open_backup(path)
    assert [robot.name for robot in backup.robots] == ["OUTER"]
    assert backup.files["C/inner.zip"] == inner
    named = [issue.path for issue in backup.issues if issue.code == "NESTED_ARCHIVE"]
    assert named == [f"{path}:C/old.zip", f"{path}:C/inner.zip"]


def test_a_folder_of_archives_is_not_opened(respot, tmp_path):
    (tmp_path / "line").mkdir()
    for name in ("020R01", "020R02"):
        packed(tmp_path / "line" / f"{name}.zip", krc(name))
    result = respot("inspect", "line")
    assert result.code == 2 and len(result.err.strip().splitlines()) == 1
    assert "020R01.zip" in result.err and "1 more" in result.err and "name it itself" in result.err


def test_an_encoded_module_and_a_foreign_file_do_not_stop_the_rest(tmp_path):
    files = {"RAPID/TASK1/PROGMOD/A.mod": module("A"), "RAPID/TASK1/SYSMOD/Hidden.sys": "\xfc\x01\x02\x03"}
    files["RAPID/TASK1/SYSMOD/driver.sys"] = "MZ no module at all"
    (robot,) = open_backup(write(tmp_path / "all", files)).robots
    issues = {issue.code: issue.path for issue in robot.issues}
    assert issues["BINARY_MODULE"] == "RAPID/TASK1/SYSMOD/Hidden.sys"
    assert issues["NOT_A_PROGRAM"] == "RAPID/TASK1/SYSMOD/driver.sys"
    assert robot.programs == ["A"]


def test_am_ini_names_the_robot_and_the_folder_where_there_is_none(tmp_path):
    files = {"020R01/KRC/R1/Program/a.src": src("a"), "020R02/krc/r1/program/a.src": src("a")}
    files["020R02/AM.INI"] = am_ini("ST20R02").upper()
    assert [name for name, _, _ in found(write(tmp_path / "all", files))] == ["020R01", "ST20R02"]
