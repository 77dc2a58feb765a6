"""One controller, several robots: each has its task, its machine data and its files; the other one stays as it was."""

from __future__ import annotations

import json

import numpy as np
import pytest

from respot.backups import open_backup
from respot.calibration.calibration import Calibration
from respot.kinematics.cell import Reason
from respot.kinematics.from_backup import cell_of
from tests.backups.trees import MOC, MULTIMOVE, SYS, backinfo, module, system_xml, write
from tests.correction.small import SPOTS, rapid


def robots(tmp_path, **changes):
    files = {**MULTIMOVE, **{path: text for path, text in changes.items() if text is not None}}
    files = {path: text for path, text in files.items() if path not in changes or changes[path] is not None}
    return open_backup(write(tmp_path / "SYS1", files)).robots


def unknown(robot) -> list[str]:
    return [issue.message for issue in robot.issues if issue.code == "UNKNOWN_TASK"]


def test_each_moving_task_is_a_robot(tmp_path):
    first, second = robots(tmp_path)
    assert (first.name, second.name) == ("SYS1 T_ROB1", "SYS1 T_ROB2")
    assert (first.task, second.task) == ("T_ROB1", "T_ROB2")
    assert first.root == second.root == ""
    # TASK1 moves nothing: it belongs to the first, although it is the first folder and names a group
    assert set(first.files) == {
        "RAPID/TASK1/PROGMOD/Comm.mod",
        "RAPID/TASK2/PROGMOD/Main.mod",
        "RAPID/TASK2/SYSMOD/user.sys",
    }
    assert set(second.files) == {"RAPID/TASK10/PROGMOD/Main.mod"}
    assert [move.target.number("x") for move in first.moves()] == [601.0]
    assert [move.target.number("x") for move in second.moves()] == [602.0]
    assert unknown(first) == unknown(second) == []


def test_each_robot_has_its_own_machine_data(tmp_path):
    first, second = robots(tmp_path)
    assert (first.machine.model, second.machine.model) == ("ROB1_6700_2.60_200", "ROB2_1200_0.7_7")
    cells = [cell_of(robot.machine, "rapid") for robot in (first, second)]
    assert [cell.model.name for cell in cells] == ["irb6700_200_260", "irb1200_7_70"]
    assert [cell.robroot.translation.tolist() for cell in cells] == [[1500, 250, 0], [-3500, 0, 0]]
    assert [cell.absolute_accuracy for cell in cells] == [True, False]
    assert [cell.external_axes for cell in cells] == [0, 1]
    assert [np.degrees(bound).round(3) for bound in (2.0, 1.0)] == [cell.limits[0, 1].round(3) for cell in cells]
    assert [robot.machine.facts["serial"].value for robot in (first, second)] == ["67-111", "12-222"]
    assert first.machine.facts["absolute accuracy"].value == "active (r1_calib)"
    assert second.machine.facts["absolute accuracy"].value == "not active (r2_uncalib)"


@pytest.mark.parametrize("spelling", ["-USEMECHANICALUNITGROUP", "-usemechanicalunitgroup"])
def test_attributes_in_any_case(tmp_path, spelling):
    spelt = SYS.replace("-UseMechanicalUnitGroup", spelling).replace("-MotionTask", "-motiontask")
    first, second = robots(tmp_path, **{"SYSPAR/SYS.cfg": spelt})
    assert (first.machine.model, second.machine.model) == ("ROB1_6700_2.60_200", "ROB2_1200_0.7_7")


def test_numbers_of_tasks_mean_nothing(tmp_path):
    """The names of robots and groups decide, crossed here: T_ROB1 moves ROB_2."""
    crossed = SYS.replace('"ROB_1"', '"X"').replace('"ROB_2"', '"ROB_1"').replace('"X"', '"ROB_2"')
    first, second = robots(tmp_path, **{"SYSPAR/SYS.cfg": crossed})
    assert (first.name, first.machine.model) == ("SYS1 T_ROB1", "ROB2_1200_0.7_7")
    assert (second.name, second.machine.model) == ("SYS1 T_ROB2", "ROB1_6700_2.60_200")


def test_a_positioner_task_is_no_robot(tmp_path):
    station = SYS.replace('-Robot "ROB_2" ', "")
    (robot,) = robots(tmp_path, **{"SYSPAR/SYS.cfg": station})
    assert (robot.name, robot.task, robot.machine.model) == ("SYS1", "", "ROB1_6700_2.60_200")
    assert len(robot.files) == 4


def test_one_moving_task_is_one_robot_with_all_tasks(tmp_path):
    single = SYS.replace('-UseMechanicalUnitGroup "second" -MotionTask', "")
    (robot,) = robots(tmp_path, **{"SYSPAR/SYS.cfg": single})
    assert (robot.name, robot.task) == ("SYS1", "")
    assert len(robot.files) == 4 and robot.machine.model == "ROB1_6700_2.60_200"
    assert robot.machine.facts["task"].value == "T_ROB1"


def test_a_group_that_names_no_robot_of_moc_cfg(tmp_path):
    strange = MOC.replace('"ROB_2"', '"GANTRY"')
    first, second = robots(tmp_path, **{"SYSPAR/MOC.cfg": strange})
    assert unknown(first) == []
    assert len(unknown(second)) == 1 and "ROB_2" in unknown(second)[0] and "GANTRY" in unknown(second)[0]
    assert isinstance(cell_of(second.machine, "rapid"), Reason)


def test_without_backinfo_the_tasks_that_hold_motions_are_robots(tmp_path):
    """Folder numbers are no names of tasks: which robot each moves is said to be unknown, not guessed."""
    first, second = robots(tmp_path, **{"BACKINFO/backinfo.txt": None})
    assert (first.name, second.name) == ("SYS1 TASK2", "SYS1 TASK10")
    assert len(unknown(first)) == len(unknown(second)) == 1 and "backinfo.txt" in unknown(first)[0]
    assert all(isinstance(cell_of(robot.machine, "rapid"), Reason) for robot in (first, second))


def test_without_sys_cfg_but_with_the_option_multimove(tmp_path):
    first, second = robots(tmp_path, **{"SYSPAR/SYS.cfg": None, "SYSPAR/MOC.cfg": None})
    assert (first.name, second.name) == ("SYS1 T_ROB1", "SYS1 T_ROB2")
    assert "SYS.cfg" in unknown(first)[0]


def test_tasks_under_their_names(tmp_path):
    named = {path.replace("TASK2/", "T_ROB1/").replace("TASK10/", "T_ROB2/"): text for path, text in MULTIMOVE.items()}
    del named["BACKINFO/backinfo.txt"]
    first, second = open_backup(write(tmp_path / "SYS1", named)).robots
    assert (first.machine.model, second.machine.model) == ("ROB1_6700_2.60_200", "ROB2_1200_0.7_7")


def test_nothing_known_is_one_robot_and_says_so(tmp_path):
    bare = {path: text for path, text in MULTIMOVE.items() if path.startswith("RAPID/")}
    (robot,) = open_backup(write(tmp_path / "bare", bare)).robots
    assert robot.name == "bare" and len(robot.files) == 4
    assert len(unknown(robot)) == 1 and "TASK2, TASK10" in unknown(robot)[0]


def test_persistent_data_are_seen_across_the_robots(tmp_path):
    """A PERS target that two tasks declare is one value in the controller: it is moved in neither."""
    shared = "  PERS robtarget common:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    own = "  PROC r2()\n    MoveL common,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    texts = [module(f"Main{n}", 600.0 + n, shared).replace("ENDMODULE\n", own) for n in (1, 2)]
    first, second = robots(
        tmp_path, **{"RAPID/TASK2/PROGMOD/Main.mod": texts[0], "RAPID/TASK10/PROGMOD/Main.mod": texts[1]}
    )
    for robot in (first, second):
        (move,) = [move for move in robot.moves() if move.target.name == "common"]
        assert "several tasks" in move.unknown


def two_robots() -> dict[str, str]:
    """Both tasks hold the same modules, letter for letter, so that nothing but the task tells them apart."""
    files = {path: text for path, text in MULTIMOVE.items() if not path.startswith("RAPID/")}
    files["BACKINFO/backinfo.txt"] = backinfo("TASK1: (T_ROB1,,)", "TASK2: (T_ROB2,,)")
    cell = rapid()
    # PERS of both tasks would be one value
    local = {path: text.replace("  PERS ", "  TASK PERS ") for path, text in cell.items()}
    return {**files, **local, **{path.replace("TASK1", "TASK2"): text for path, text in local.items()}}


@pytest.mark.parametrize(("task", "folder"), [("T_ROB1", "TASK1"), ("T_ROB2", "TASK2")])
def test_converting_one_robot_leaves_the_other_as_it_was(respot, tmp_path, task, folder):
    source = write(tmp_path / "SYS1", two_robots())
    calibration = Calibration(np.eye(3), np.array([3.0, -2.0, 1.0]), "theory", "same", tuple(SPOTS))
    (tmp_path / "cal.json").write_text(calibration.to_json())
    assert "SEVERAL_ROBOTS" in respot("convert", "SYS1", "-c", "cal.json", "-o", "out").err
    arguments = ["convert", "SYS1", "-c", "cal.json", "-o", "out", "--robot-name", f"sys1 {task.lower()}", "--json"]
    result = respot(*arguments, "--keep-config")
    record = json.loads(result.out)
    assert result.code == 0, result.err
    assert {edit["path"] for edit in record["edits"]} == {f"RAPID/{folder}/PROGMOD/Weld.mod"}
    assert {edit["target"] for edit in record["edits"]} == set(SPOTS)
    old = {path.relative_to(source): path.read_bytes() for path in source.rglob("*") if path.is_file()}
    new = {path: (tmp_path / "out" / path).read_bytes() for path in old}
    assert {path.as_posix() for path in old if old[path] != new[path]} == {f"RAPID/{folder}/PROGMOD/Weld.mod"}


def test_robots_of_one_controller_are_converted_one_after_the_other(respot, tmp_path):
    write(tmp_path / "SYS1", two_robots())
    calibration = Calibration(np.eye(3), np.array([3.0, -2.0, 1.0]), "theory", "same", tuple(SPOTS))
    (tmp_path / "cal.json").write_text(calibration.to_json())

    def convert(source: str, output: str, task: str):
        name = ["--robot-name", f"SYS1 {task}"]
        return respot("convert", source, "-c", "cal.json", "-o", output, *name, "--keep-config")

    assert convert("SYS1", "one", "T_ROB2").code == 0
    both = convert("one", "both", "T_ROB1")
    assert both.code == 0, both.err
    for folder in ("TASK1", "TASK2"):
        first, last = (tmp_path / name / f"RAPID/{folder}/PROGMOD/Weld.mod" for name in ("SYS1", "both"))
        assert first.read_bytes() != last.read_bytes()
    again = convert("both", "again", "T_ROB1")
    assert again.code == 2 and "ALREADY_APPLIED" in again.err


def test_the_list_of_robots_in_the_message(respot, tmp_path):
    write(tmp_path / "SYS1", MULTIMOVE)
    (tmp_path / "theory.csv").write_text("id,x,y,z\nS1,0,0,0\n")
    result = respot("fit", "SYS1", "--theory", "theory.csv")
    assert result.code == 2 and "SEVERAL_ROBOTS" in result.err and "SYS1 T_ROB1, SYS1 T_ROB2" in result.err
    result = respot("inspect", "SYS1", "--robot-name", "SYS1 t_rob2", "--json")
    assert [robot["model"] for robot in result.json["robots"]] == ["ROB2_1200_0.7_7"]
    result = respot("inspect", "SYS1", "--robot-name", "T_ROB3")
    assert result.code == 2 and "NO_ROBOT" in result.err and "SYS1 T_ROB1, SYS1 T_ROB2" in result.err


def test_backups_of_one_multimove_controller_beside_each_other(tmp_path):
    files = {f"{day}/{path}": text for day in ("monday", "friday") for path, text in MULTIMOVE.items()}
    names = [robot.name for robot in open_backup(write(tmp_path / "all", files)).robots]
    assert names == ["friday T_ROB1", "friday T_ROB2", "monday T_ROB1", "monday T_ROB2"]


def test_one_robot_with_a_copied_module_in_a_background_task(tmp_path):
    """MOC.cfg knows one robot: a second task with motions in its modules makes no second one."""
    files = {
        "system.xml": system_xml("SYS1", "604-1 MultiMove Coordinated"),
        "SYSPAR/MOC.cfg": 'MOC:CFG_1.0:6:0::\n#\nROBOT:\n\n      -name "ROB_1" -use_robot_type "ROB1_6700_2.60_200"\n',
        "RAPID/TASK1/PROGMOD/A.mod": module("A"),
        "RAPID/TASK2/PROGMOD/A.mod": module("A"),
    }
    (robot,) = open_backup(write(tmp_path / "all", files)).robots
    assert robot.machine.model == "ROB1_6700_2.60_200" and len(robot.files) == 2
