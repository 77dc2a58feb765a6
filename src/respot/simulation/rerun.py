"""The same line once more, with other programs: what is hidden in it stays as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats, forward, inverse
from respot.simulation.effects import make_effect, read_wish
from respot.simulation.line import Line, amplitude, chance_of, draw_cell
from respot.simulation.robots import spec_of
from respot.simulation.state import Cell, State


@dataclass(frozen=True)
class Landing:
    """Where the TCP really goes.

    Parameters
    ----------
    positions : ndarray of shape (n, 3)
        In the tracker's frame, without noise [mm]; row i is spot i.
    rotations : scipy Rotation of length n
        How the tool stands, in the same frame.
    joints : ndarray of shape (n, 6)
        Commanded joints [deg].
    """

    positions: Floats
    rotations: Rotation
    joints: Floats


def rerun(line: Line, effects: Sequence[str], positions: Floats, rotations: Rotation) -> Landing:
    """Run a line with other poses.

    Parameters
    ----------
    line : Line
        As `simulate` made it.
    effects : sequence of str
        What it was made with. Each is drawn as for the line, at the size that it has there.
    positions : ndarray of shape (n, 3)
        New poses of its spots in the world [mm], in the order of the line; each a little off the old one.
    rotations : scipy Rotation of length n
        New orientations.

    Raises
    ------
    ValueError
        The arm does not reach a pose.
    """
    spec = spec_of(str(line.robot["name"]))
    old = draw_cell(spec, line.n, line.layout, line.external_axes is not None, line.seed)
    flange = np.asarray(rotations.as_matrix()) @ old.gun.turn.T
    at = positions - flange @ old.gun.at - old.layout.root_at
    joints, reached = inverse(spec, flange, at, old.layout.joints[:, 4] * _sense(spec.signs[4]) < 0)
    if not reached.all():
        raise ValueError("the arm does not reach every pose")
    tool = np.asarray(rotations.as_matrix())
    layout = replace(old.layout, joints=joints, positions=np.asarray(positions, dtype=np.float64), tool=tool)
    new = Cell(spec, old.gun, layout, old.columns, forward(spec, joints, root_at=old.layout.root_at), old.tracker)
    state = State(line.n)
    for number, wish in enumerate(read_wish(text) for text in effects):
        size = amplitude(make_effect(wish, old, chance_of(line.seed, wish.name, number)), old, wish.size)
        make_effect(wish, new, chance_of(line.seed, wish.name, number)).push(state, size)
    turn, shift = Rotation.from_matrix(line.world2tracker[:3, :3]), line.world2tracker[:3, 3]
    return Landing(turn.apply(state.positions(new)) + shift, turn * state.orientations(new), joints)


def _sense(sign: float) -> float:
    """Sense of an axis of the arm's own chain against the maker's."""
    return float(np.sign(sign))
