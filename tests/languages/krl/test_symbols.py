"""Where the target of a motion lives, a fixture for each trap (facts: krl.md sections 2 and 10)."""

from __future__ import annotations

import pytest

from tests.languages.krl.binding import issues, moves, read, world

# BASE_DATA[1] is turned by 90 degrees about z, its origin at 1000, 0, 500: (x, y, z) lies at (1000 - y, x, 500 + z)


def test_a_local_point_hides_a_global_one_with_all_its_elements():
    first, second = moves("local_shadows_global")
    assert first.target.path.endswith("weld.dat")
    assert world(first) == [980, 10, 530]
    assert second.target is None  # the local list has no second element, whatever the global one has
    assert second.codes == ("UNKNOWN_TARGET",)


def test_a_name_in_other_case_is_the_same():
    (move,) = moves("other_case")
    assert move.target.name == "XP1"
    assert world(move) == [980, 10, 530]


def test_elements_of_one_to_three_dimensions():
    found = moves("array_elements")
    assert [str(move.target) for move in found[:4]] == ["XA[2]", "XB[1,2]", "XC[1,1,2]", "XA[2]"]
    assert [world(move)[1] for move in found[:4]] == [2, 12, 112, 2]
    assert found[0].target is found[3].target  # a target used twice is one target


def test_an_index_that_the_program_counts_is_not_known():
    robot = read("array_elements")
    found = list(robot.moves())
    for move in found[4:6]:
        assert move.target is None
        assert move.codes == ("RUN_TIME_POSE",)
        assert "XA[I]" in move.unknown
    assert found[6].target is None  # never given a value
    assert [line for code, _, line in issues(robot) if code == "RUN_TIME_POSE"] == [10]  # one for both motions
    (issue,) = [issue for issue in robot.issues if issue.code == "RUN_TIME_POSE"]
    assert "2 motions" in issue.message


def test_only_the_element_that_is_written_is_not_known():
    first, second = moves("one_element_written")
    assert first.codes == ("RUN_TIME_POSE",)
    assert second.codes == ()


def test_points_in_structures():
    pick, rack, drop = moves("structure_members")
    assert (pick.target.name, world(pick)) == ("STATION.PICK", [980, 10, 530])
    assert (rack.target.name, world(rack)) == ("RACK[2].PICK", [950, 40, 560])
    assert (drop.target, drop.codes) == (None, ("RUN_TIME_POSE",))


def test_imports_lead_to_the_datum_itself():
    first, written, chained = moves("imported_points")
    assert first.target.path.endswith("shared.dat")
    assert first.target is chained.target
    assert world(first) == [980, 10, 530]
    assert written.codes == ("RUN_TIME_POSE",)  # another import of it is assigned to


def test_a_circle_of_imports_is_an_issue_and_the_rest_is_read():
    robot = read("cyclic_import")
    first, second = robot.moves()
    assert (first.target, first.codes) == (None, ("UNKNOWN_TARGET",))
    assert world(second) == [980, 10, 530]
    assert [found for found in issues(robot) if found[0] == "CYCLIC_IMPORT"] == [("CYCLIC_IMPORT", "other.dat", 3)]


def test_two_globals_of_one_name_are_an_issue_with_both_places():
    robot = read("two_globals_of_one_name")
    first, second = robot.moves()
    assert (first.target, first.codes) == (None, ("AMBIGUOUS_NAME",))
    assert world(second) == [980, 10, 530]
    found = [issue for issue in robot.issues if issue.code == "AMBIGUOUS_NAME"]
    (twice,) = [issue for issue in found if str(issue.path).endswith("first.dat")]
    assert twice.line == 3
    assert "second.dat:3" in twice.message


def test_what_other_modules_cannot_see_is_not_declared():
    robot = read("hidden_global")
    first, second = robot.moves()
    assert first.codes == second.codes == ("UNKNOWN_TARGET",)
    assert "private.dat:3" in first.unknown  # GLOBAL in a list that is not PUBLIC
    assert "shared.dat:3" in second.unknown  # not GLOBAL in a list that is


def test_undeclared_points_are_one_issue_for_a_routine():
    robot = read("undeclared_points")
    found = [issue for issue in robot.issues if issue.code == "UNKNOWN_TARGET"]
    assert [(issue.line, "XN1" in issue.message, "XN2" in issue.message) for issue in found] == [(8, True, True)]
    assert "3 motions" in found[0].message
    home = list(robot.moves())[-1]
    assert (home.target, home.codes) == (None, ())  # a program without its $config.dat goes home all the same


def test_parameters_tell_what_callers_pass():
    first, second = moves("parameters")
    assert first.target is second.target is None
    assert "XP1" in first.unknown and "weld.src:3" in first.unknown and "weld.src:4" in first.unknown
    assert "callers pass XP2" in second.unknown


@pytest.mark.parametrize("index", [0, 1])
def test_what_the_code_fills_is_not_known(index):
    move = moves("filled_in_code")[index]
    assert move.target is None
    assert move.codes == ("RUN_TIME_POSE",)
