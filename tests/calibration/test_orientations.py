"""Orientations of both lists: compared under the fitted rotation, and never allowed to move it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration import fit_spots
from respot.calibration.report import report

from .tool_world import matrix, world


def made_with_orientations(seed=5, n=16):
    """A world with a known rotation and the orientations that the reference would show."""
    rng = np.random.default_rng(seed)
    made = world(rng, n=n, offset=np.zeros(3))
    rotation = matrix(np.array([0.3, -0.2, 0.5]))
    made.reference = made.source @ rotation.T + [10.0, 20.0, 30.0] + rng.normal(0.0, 0.3, made.source.shape)
    return made, Rotation.from_matrix(np.array([rotation @ tool for tool in made.tools]))


def fitted(made, reference_rotations, source_rotations=None):
    tools = Rotation.from_matrix(made.tools) if source_rotations is None else source_rotations
    return fit_spots(
        made.ids, made.source, made.reference, source_rotations=tools, reference_rotations=reference_rotations
    )


def test_orientations_that_agree():
    made, reference = made_with_orientations()
    result = report(fitted(made, reference))["orientations"]
    json.dumps(result, allow_nan=False)
    assert result["after"]["rms"] < 0.1 < 30.0 < result["as_found"]["rms"]
    assert (result["unit"], result["convention"]) == ("deg", None)
    assert "agree" in result["verdict"]


def test_a_constant_turn_of_the_tool_frame():
    """The reference's tool frame is turned by 90 degrees about the source's own x axis."""
    made, reference = made_with_orientations()
    found = fitted(made, reference * Rotation.from_euler("x", 90, degrees=True)).orientations
    assert found.code == "ORIENTATIONS_TURNED"
    np.testing.assert_allclose(found.turn, [90, 0, 0], atol=0.1)
    assert found.scatter.max() < 0.05


@pytest.mark.parametrize(
    ("written", "words"),
    [
        (lambda r: Rotation.from_euler("ZYX", r.as_euler("ZYX")[:, ::-1]), "A about x"),
        (lambda r: Rotation.from_euler("ZYX", r.as_euler("XYZ")), "moving x, y, z"),
        (lambda r: Rotation.from_euler("ZYX", r.as_euler("zyx")), "fixed z, y, x"),
        (lambda r: Rotation.from_quat(r.as_quat(scalar_first=False), scalar_first=True), "scalar last"),
        (lambda r: r.inv(), "inverse"),
        (lambda r: Rotation.from_euler("ZYX", r.as_euler("ZYX"), degrees=True), "radians"),
        (lambda r: Rotation.from_euler("ZYX", r.as_euler("ZYX") * [1, -1, 1]), "sign of B"),
    ],
    ids=["roll-pitch-yaw", "moving-xyz", "fixed-zyx", "scalar-last", "inverse", "radians", "sign"],
)
@pytest.mark.parametrize("side", ["source", "reference"])
def test_a_wrong_convention_is_named_and_moves_no_position(written, words, side):
    made, reference = made_with_orientations()
    tools = Rotation.from_matrix(made.tools)
    fit = fitted(made, reference, written(tools)) if side == "source" else fitted(made, written(reference))
    assert fit.orientations.code == "ORIENTATION_CONVENTION"
    assert words in fit.orientations.convention
    assert fit.orientations.convention.startswith(f"the {side}")
    plain = fit_spots(made.ids, made.source, made.reference)
    np.testing.assert_array_equal(fit.model.rotation, plain.model.rotation)
    np.testing.assert_array_equal(fit.model.translation, plain.model.translation)


def test_orientations_of_another_list():
    made, reference = made_with_orientations()
    found = fitted(made, Rotation.random(16, random_state=3)).orientations
    assert (found.code, found.convention) == ("ORIENTATIONS_DISAGREE", None)
    assert fitted(made, None).orientations is None
    assert fitted(made, reference).orientations is not None
