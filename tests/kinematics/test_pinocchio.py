"""Our kinematics against pinocchio's: poses, derivatives, all branches, status and turn, confdata, torques."""

import numpy as np
import pytest
from branches import ABB_BRANCHES, KUKA_BRANCHES
from by_pinocchio import ABB, KUKA
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY
from respot.kinematics.cell import RobotCell
from respot.kinematics.configuration import configuration_of, taught_joints
from respot.kinematics.gravity import gravity_basis
from respot.kinematics.robots import find_robot

PRIME = RobotCell(find_robot("kr210_r2700_prime"), "krl")
IRB6700 = RobotCell(find_robot("irb6700_200_260"), "rapid")
PAIRS = {"kuka": (PRIME, KUKA), "abb": (IRB6700, ABB)}
makers = st.sampled_from(sorted(PAIRS))
TABLES = [
    (PRIME, KUKA, [(np.array(q, dtype=float), [s, t]) for q, s, t in KUKA_BRANCHES]),
    (IRB6700, ABB, [(np.array(q, dtype=float), list(numbers)) for q, numbers in ABB_BRANCHES]),
]
ANGLES = st.lists(st.floats(-359.0, 359.0), min_size=6, max_size=6)
NEWTON = 9.81


def by_definition(cell, arm, joints):
    return arm.status_turn(joints) if cell.language == "krl" else arm.confdata(joints)


def apart(first, second):
    return np.abs((first - second + 180) % 360 - 180).max(axis=-1)


@given(makers, ANGLES)
def test_poses(maker, joints):
    cell, arm = PAIRS[maker]
    ours, theirs = cell.model.forward(joints).as_matrix(), arm.forward(joints)
    assert np.abs(ours[:3, 3] - theirs[:3, 3]).max() < 1e-6
    assert np.abs(ours[:3, :3] - theirs[:3, :3]).max() < 1e-12


@given(makers, ANGLES)
def test_jacobians(maker, joints):
    cell, arm = PAIRS[maker]
    assert cell.model.jacobian(joints)[0] == pytest.approx(arm.jacobian(joints), abs=1e-9)


# Each of our parameters as a column of `placement_jacobian`, from 0: six to an axis, x y z and turns about them; negative
# where ours counts the other way. KUKA's upper arm lies along x at zero, ABB's stands along z.
X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z = range(6)
PLACES = {
    "c1": (0, Z, 1), "a1": (6, X, 1), "b": (6, Y, 1), "a2": (18, Z, -1), "c3": (24, X, 1),
    "offset_1": (0, ABOUT_Z, -1), "offset_2": (6, ABOUT_Y, -1), "offset_3": (12, ABOUT_Y, -1),
    "offset_4": (18, ABOUT_X, -1), "offset_5": (24, ABOUT_Y, -1), "offset_6": (30, ABOUT_X, -1),
}  # fmt: skip


@given(makers, ANGLES)
def test_derivatives_by_lengths_and_offsets(maker, joints):
    cell, arm = PAIRS[maker]
    ours, theirs = cell.model.parameter_jacobian(joints)[0], arm.placement_jacobian(joints)
    places = {**PLACES, "c2": (12, X if maker == "kuka" else Z, 1)}
    assert {*places, "c4"} == {*cell.model.parameter_names}
    for name, (axis, way, sign) in places.items():
        column = ours[:, cell.model.parameter_names.index(name)]
        assert column == pytest.approx(sign * theirs[:, axis + way], abs=1e-9), name


@pytest.mark.parametrize(("cell", "arm", "table"), TABLES)
def test_the_table_by_hand_is_what_pinocchio_finds(cell, arm, table):
    found = arm.inverse(table[0][0])
    assert len(found) == 8
    for joints, numbers in table:
        (solution,) = found[apart(found, joints) < 1e-5]
        assert by_definition(cell, arm, solution) == numbers


def collected(cell, arm, joints):
    """Solutions by both, after having seen that they are the same ones."""
    theirs = arm.inverse(joints)
    ours = cell.model.inverse(cell.model.forward(joints))[0]
    ours = ours[np.isfinite(ours).all(axis=1)]
    assert len(ours) == len(theirs)
    for solution in theirs:
        assert apart(ours, solution).min() < 1e-6
    return ours, theirs


@pytest.mark.parametrize(
    ("cell", "arm", "joints", "count"),
    [
        (PRIME, KUKA, KUKA_BRANCHES[0][0], 8),
        (IRB6700, ABB, ABB_BRANCHES[0][0], 8),
        (PRIME, KUKA, (-70, -100, 110, -120, 65, 200), 8),
        (IRB6700, ABB, (100, -20, 20, 60, -80, -300), 8),
        # far out only the arm in front of axis 1 reaches
        (PRIME, KUKA, (40, -35, 30, 10, -50, 70), 4),
        (IRB6700, ABB, (-20, 70, -50, 10, 50, 70), 4),
    ],
)
def test_every_branch_is_found_by_both_with_its_numbers(cell, arm, joints, count):
    ours, theirs = collected(cell, arm, joints)
    assert len(ours) == count
    goal = arm.forward(joints)
    seen = set()
    for solution in theirs:
        assert np.abs(cell.model.forward(solution).as_matrix() - goal).max() < 1e-6
        numbers = by_definition(cell, arm, solution)
        seen.add(tuple(numbers))
        assert configuration_of(cell, solution)[0].tolist() == numbers
        # and back: the numbers choose this solution among the eight
        flange = RigidTransform.from_matrix(goal)
        taught, reasons = taught_joints(cell, IDENTITY, flange, numbers)
        assert reasons == (None,)
        assert apart(taught[0], solution) < 1e-6
    assert len(seen) == count


@given(makers, ANGLES)
def test_status_turn_and_confdata_are_the_definitions(maker, joints):
    cell, arm = PAIRS[maker]
    from_first, from_third = arm.wrist(joints)
    assume(abs(from_first[0]) > 1e-6 and np.abs(from_third[[0, 2]]).min() > 1e-6)
    assert configuration_of(cell, joints)[0].tolist() == by_definition(cell, arm, joints)


@given(makers, ANGLES)
def test_torques_of_gravity(maker, joints):
    """Masses hang where pinocchio's description has them; the basis gives the load, pinocchio what holds it."""
    cell, arm = PAIRS[maker]
    rotations, origins = cell.model.frames(joints)
    arm.place(joints)
    load = np.zeros(6)
    basis = gravity_basis(cell.model, joints, [0, 0, -1])[0]
    for link, (mass, centre) in enumerate(arm.bodies):
        world = 1000 * arm.data.oMi[link + 1].act(np.array(centre) / 1000)
        lever = rotations[0, link].T @ (world - origins[0, link])
        load += basis[:, link] @ (mass * NEWTON * np.array([1.0, *lever]))
    assert load == pytest.approx(-arm.holding(joints), abs=1e-3)
