from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.calibration import Calibration, CalibrationError, fit_spots
from respot.calibration.precision import Precision, with_precision


@pytest.fixture(scope="module")
def calibration(points):
    return fit_spots(*points.rear_door(), provenance={"source": "0123", "version": "0"}).calibration


def test_saved_and_loaded_to_the_last_bit(calibration, tmp_path):
    path = tmp_path / "cal.json"
    calibration.save(path)
    again = Calibration.load(path)
    assert np.array_equal(again.rotation, calibration.rotation)
    assert np.array_equal(again.translation, calibration.translation)
    assert again.content_hash == calibration.content_hash
    assert again.ids == calibration.ids
    assert again.provenance == calibration.provenance
    assert again.to_json() == calibration.to_json()
    assert b"\r" not in path.read_bytes()
    with pytest.raises(ValueError, match="read-only"):
        calibration.rotation[0, 0] = 2


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_predict_and_invert(points, seed):
    rng = np.random.default_rng(seed)
    rotation, shift = points.random_motion(rng)
    calibration = Calibration(rotation=rotation, translation=np.array(shift), kind="measured", frame="free")
    spots = rng.uniform(-5000, 5000, (7, 3))
    tools = Rotation.from_euler("ZYX", rng.uniform(-180, 180, (7, 3)), degrees=True)
    moved, turned = calibration.predict(spots, tools)
    np.testing.assert_allclose(moved, points.move(spots, rotation, shift), atol=1e-9)
    np.testing.assert_allclose(turned.as_matrix(), rotation @ tools.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(calibration.source2reference.apply(spots), moved, atol=1e-8)
    back, untouched = calibration.inverse().predict(moved, turned)
    np.testing.assert_allclose(back, spots, atol=1e-9)
    np.testing.assert_allclose(untouched.as_matrix(), tools.as_matrix(), atol=1e-12)


def test_the_hash_covers_the_correction_and_nothing_else(calibration):
    def variant(**changes):
        values = {name: getattr(calibration, name) for name in ("rotation", "translation", "kind", "frame", "ids")}
        return Calibration(**{**values, **changes}).content_hash

    assert variant(ids=calibration.ids[::-1], provenance={"x": 1}) == calibration.content_hash
    moved = calibration.translation + 1e-9
    changed = {variant(translation=moved), variant(kind="measured"), variant(frame="free")}
    changed.add(variant(ids=("a",)))  # the spots decide which programs are in scope
    assert len(changed | {calibration.content_hash, calibration.inverse().content_hash}) == 6
    assert calibration.inverse().provenance["inverse_of"] == calibration.content_hash
    zero = Calibration(rotation=np.eye(3), translation=np.zeros(3), kind="theory", frame="same")
    negative = Calibration(rotation=np.eye(3) * 1.0 - 0.0, translation=-np.zeros(3), kind="theory", frame="same")
    assert zero.content_hash == negative.content_hash


def test_the_hash_is_a_promise():
    identity = Calibration(rotation=np.eye(3), translation=np.array([1.5, 0, 0.1]), kind="theory", frame="same")
    assert identity.content_hash == "d455d8301dcb1f273cde22f474f50686b0999bb79807a7a5eb85b025895e617c"


def changed(calibration, **entries):
    record = json.loads(calibration.to_json())
    record.update(entries)
    return json.dumps({name: value for name, value in record.items() if value is not None})


@pytest.mark.parametrize(
    ("entries", "code"),
    [
        ({"schema": "respot.calibration/2"}, "CALIBRATION_SCHEMA"),
        ({"schema": None}, "CALIBRATION_SCHEMA"),
        ({"schema": "respot.fit/1"}, "CALIBRATION_SCHEMA"),
        ({"schema": 1}, "CALIBRATION_SCHEMA"),
        ({"tool_offset": [1.0, 0.0, 0.0]}, "CALIBRATION_SCHEMA"),
        ({"tool_offset": [1.0, 0.0]}, "CALIBRATION_INCOMPLETE"),
        ({"precision": {}}, "CALIBRATION_INCOMPLETE"),
        ({"precision": 3}, "CALIBRATION_INCOMPLETE"),
        ({"translation": [0.0, 0.0, 0.0]}, "CALIBRATION_CHANGED"),
        ({"kind": "measured"}, "CALIBRATION_CHANGED"),
        ({"hash": "00"}, "CALIBRATION_CHANGED"),
        ({"kind": "guess"}, "CALIBRATION_INCOMPLETE"),
        ({"rotation": None}, "CALIBRATION_INCOMPLETE"),
        ({"hash": None}, "CALIBRATION_INCOMPLETE"),
        ({"ids": 3}, "CALIBRATION_INCOMPLETE"),
        ({"rotation": "abc"}, "CALIBRATION_INCOMPLETE"),
        ({"rotation": [[1, 0], [0, 1]]}, "CALIBRATION_INCOMPLETE"),
        ({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "CALIBRATION_NOT_RIGID"),
        ({"rotation": [[1, 0, 0], [0, 1.001, 0], [0, 0, 1]]}, "CALIBRATION_NOT_RIGID"),
        ({"translation": [0, 0, float("nan")]}, "CALIBRATION_NOT_RIGID"),
    ],
)
def test_a_broken_file_is_refused_with_a_code(calibration, tmp_path, entries, code):
    path = tmp_path / "cal.json"
    path.write_text(changed(calibration, **entries), encoding="utf-8")
    with pytest.raises(CalibrationError) as caught:
        Calibration.load(path)
    assert caught.value.code == code
    assert "cal.json" in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"[1]", b"{", b"\xff\xfe\x00", b"[" * 100_000])
def test_what_is_no_calibration_is_unreadable(tmp_path, content):
    path = tmp_path / "cal.json"
    path.write_bytes(content)
    with pytest.raises(CalibrationError) as caught:
        Calibration.load(path)
    assert caught.value.code == "CALIBRATION_UNREADABLE"
    with pytest.raises(CalibrationError, match="cannot be read"):
        Calibration.load(tmp_path / "absent.json")


@pytest.fixture(scope="module")
def sure(points):
    hashes = {"source": "door.zip", "source_sha256": "aa", "reference": "theory.csv", "reference_sha256": "bb"}
    return with_precision(fit_spots(*points.rear_door(), provenance=hashes))


def test_precision_is_saved_and_is_not_part_of_the_hash(sure, tmp_path):
    path = tmp_path / "cal.json"
    sure.save(path)
    again = Calibration.load(path)
    for name in ("covariance", "centroid", "noise", "residuals"):
        assert np.array_equal(getattr(again.precision, name), getattr(sure.precision, name)), name
    assert np.array_equal(again.precision.regions[0], sure.precision.regions[0])
    assert again.precision.heldout_rms == sure.precision.heldout_rms
    assert again.to_json() == sure.to_json()
    plain = replace(sure, precision=None)
    assert plain.content_hash == sure.content_hash
    assert Calibration.from_json(plain.to_json()).precision is None  # as files of before have it


def test_a_precision_changed_by_hand_is_refused(sure):
    record = json.loads(sure.to_json())
    record["precision"]["heldout"]["rms"] = 50.0
    with pytest.raises(CalibrationError) as caught:
        Calibration.from_json(json.dumps(record))
    assert caught.value.code == "CALIBRATION_CHANGED"


@pytest.mark.parametrize(
    ("schema", "words"),
    [("respot.calibration/9", "newer respot"), ("respot.fit/1", "-o CAL.json"), ("respot.calibration/0", "no version")],
)
def test_another_schema_is_refused_with_words(sure, schema, words):
    record = json.loads(sure.to_json())
    with pytest.raises(CalibrationError, match=words):
        Calibration.from_json(json.dumps({**record, "schema": schema}))


def test_a_tool_offset_has_a_schema_of_its_own(sure):
    with_tool = replace(sure, tool_offset=np.array([1.0, 2.0, 3.0]), precision=None)
    record = json.loads(with_tool.to_json())
    assert record["schema"] == "respot.calibration/2"  # who reads version 1 only would leave the offset out
    assert with_tool.content_hash != sure.content_hash
    assert Calibration.from_json(with_tool.to_json()).tool_offset.tolist() == [1, 2, 3]
    with pytest.raises(CalibrationError):
        replace(sure, tool_offset=np.array([1.0, 2.0, 3.0]))  # a covariance of 6 parameters


def drawn(points, rng, names=("a", "b"), tool=False):
    rotation, shift = points.random_motion(rng)
    provenance = {"source_sha256": names[0], "reference_sha256": names[1], "source": f"{names[0]}.csv"}
    return Calibration(
        rotation=rotation,
        translation=np.array(shift),
        kind="measured",
        frame="free",
        provenance=provenance,
        tool_offset=rng.uniform(-300, 300, 3) if tool else None,
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_inverse_is_exact_at_ten_metres(points, seed, tool):
    rng = np.random.default_rng(seed)
    model = drawn(points, rng, tool=tool)
    spots, tools = rng.uniform(-1e4, 1e4, (5, 3)), Rotation.random(5, rng=rng)
    back, turned = model.inverse().predict(*model.predict(spots, tools))
    np.testing.assert_allclose(back, spots, atol=1e-9, rtol=0)
    np.testing.assert_allclose(turned.as_matrix(), tools.as_matrix(), atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_composing_is_one_after_the_other_and_associative(points, seed, tool):
    rng = np.random.default_rng(seed)
    first, second, third = (drawn(points, rng, pair, tool) for pair in (("a", "b"), ("b", "c"), ("c", "d")))
    spots, tools = rng.uniform(-1e4, 1e4, (5, 3)), Rotation.random(5, rng=rng)
    wanted = third.predict(*second.predict(*first.predict(spots, tools)))
    for both in (first.compose(second).compose(third), first.compose(second.compose(third))):
        moved, turned = both.predict(spots, tools)
        np.testing.assert_allclose(moved, wanted[0], atol=1e-8, rtol=0)
        np.testing.assert_allclose(turned.as_matrix(), wanted[1].as_matrix(), atol=1e-12)
        assert (both.provenance["source_sha256"], both.provenance["reference_sha256"]) == ("a", "d")
        assert both.provenance["composed_of"] == [part.content_hash for part in (first, second, third)]
    same = first.compose(first.inverse()).predict(spots, tools)[0]
    np.testing.assert_allclose(same, spots, atol=1e-8, rtol=0)


def test_frames_that_are_not_known_to_meet_are_not_composed(points):
    rng = np.random.default_rng(1)
    first, second = drawn(points, rng, ("a", "b")), drawn(points, rng, ("c", "d"))
    with pytest.raises(CalibrationError, match=r"nothing proves.*c\.csv") as caught:
        first.compose(second)
    assert caught.value.code == "CALIBRATION_FRAMES"
    assert first.compose(second, same_middle=True).ids == first.ids
    nameless = replace(first, provenance={})
    with pytest.raises(CalibrationError, match="nothing proves"):
        nameless.compose(replace(second, provenance={}))
    with pytest.raises(CalibrationError, match="theory"):
        first.compose(replace(second, kind="theory"), same_middle=True)


def scattered(model, draw, points):
    """Covariance (n, 3, 3) of predictions when the true transform is drawn by its own definition, written out here."""
    seen = model.predict(points)[0]
    sure = model.precision
    root = np.linalg.cholesky(np.array(sure.covariance) + 1e-18 * np.eye(6))
    errors = draw @ root.T
    turns = Rotation.from_rotvec(np.radians(errors[:, 3:])).as_matrix()
    return np.einsum("mij,nj->mni", turns, seen - sure.centroid) + sure.centroid + errors[:, None, :3]


def test_covariance_goes_with_the_frame(points):
    """Draw the true transform, invert it, or follow it by another drawn one: the scatter is that of the new model."""
    rng = np.random.default_rng(9)
    rotation, shift = points.random_motion(rng)
    root = rng.normal(size=(6, 6)) * [[0.05], [0.02], [0.04], [0.001], [0.002], [0.003]]
    spots = rng.uniform(-900, 900, (6, 3))

    def model(turn, move, size, names):
        precision = Precision(
            size**2 * root @ root.T, np.array([400.0, -200, 900]), np.diag([4.0, 1, 0.25]), 12.0, (spots,)
        )
        where = {"source_sha256": names[0], "reference_sha256": names[1]}
        return Calibration(turn, np.array(move), "measured", "free", provenance=where, precision=precision)

    first, second = model(rotation, shift, 1.0, "ab"), model(*points.random_motion(rng), 2.0, "bc")
    asked = rng.uniform(-2000, 2000, (3, 3))
    draws = rng.normal(size=(2, 40_000, 6))

    def close(samples, found, at):
        wanted = [np.cov(samples[:, row].T) for row in range(3)]
        for mine, theirs in zip(found.precision.covariance_of(found.predict(at)[0], None), wanted, strict=True):
            np.testing.assert_allclose(mine, theirs, atol=0.03 * np.trace(theirs))

    close(scattered(first, draws[0], asked), first, asked)
    # the inverse: true points p with drawn images; where the fitted inverse puts these images, less p
    inverse, images = first.inverse(), first.predict(asked)[0]
    back = (scattered(first, draws[0], asked) - first.translation) @ first.rotation
    close(back, inverse, images)
    np.testing.assert_allclose(inverse.precision.noise, rotation.T @ np.diag([4.0, 1, 0.25]) @ rotation, atol=1e-12)
    again = inverse.inverse().precision
    np.testing.assert_allclose(again.covariance, first.precision.covariance, atol=1e-12)
    np.testing.assert_allclose(again.centroid, first.precision.centroid, atol=1e-9)
    # one after the other
    both = first.compose(second)
    middle = scattered(first, draws[0], asked)
    seen = middle @ second.rotation.T + second.translation
    root_two = np.linalg.cholesky(np.array(second.precision.covariance) + 1e-18 * np.eye(6))
    errors = draws[1] @ root_two.T
    turns = Rotation.from_rotvec(np.radians(errors[:, 3:])).as_matrix()
    centre = second.precision.centroid
    last = np.einsum("mij,mnj->mni", turns, seen - centre) + centre + errors[:, None, :3]
    close(last, both, asked)
    assert both.precision.degrees_of_freedom == pytest.approx((1.75 + 1.75) ** 2 / (2 * 1.75**2 / 12))
    assert len(both.precision.regions) == 2
    np.testing.assert_allclose(both.precision.regions[1], inverse.predict(spots)[0], atol=1e-9)


def test_the_inverse_of_a_fit_is_the_fit_the_other_way_round(points):
    """Least squares of a rigid motion does not care which list is which, and neither do its residuals and hull."""
    ids, source, reference = points.repaired()
    forth, back = (with_precision(fit_spots(ids, *lists)) for lists in ((source, reference), (reference, source)))
    turned = forth.inverse()
    np.testing.assert_allclose(turned.rotation, back.rotation, atol=1e-9)
    np.testing.assert_allclose(turned.precision.regions[0], reference, atol=1e-9)
    np.testing.assert_allclose(turned.precision.residuals, back.precision.residuals, atol=1e-6)
    np.testing.assert_allclose(turned.precision.noise, back.precision.noise, atol=1e-6)
    # covariances are taken at the predicted spots, which differ by the residuals
    mine, theirs = turned.precision.covariance, back.precision.covariance
    assert np.sqrt(np.diag(mine)) == pytest.approx(np.sqrt(np.diag(theirs)), rel=0.02)
