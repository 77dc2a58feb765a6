from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.calibration import Calibration, CalibrationError, fit_spots


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
