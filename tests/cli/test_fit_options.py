"""``respot fit --weights`` and ``--orientations``: how the final rigid part weighs what it is fitted to."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration import Calibration, fit_spots
from respot.registration.anisotropy import fit_weighted
from respot.registration.errors import RegistrationError
from respot.registration.oriented import fit_rigid_oriented

FRAME = Rotation.from_euler("ZYX", [35.0, 2.0, -3.0], degrees=True)
T14 = 2.1447867
"""97.5 % of Student's t with 14 degrees of freedom."""
SHIFT = np.array([4000.0, -200.0, 90.0])


def made(count=16, noise=(0.3, 3.0, 1.0), turn=0.03, seed=3, reach=(900.0, 60.0, 400.0)):
    """Source and reference: positions, orientations."""
    dice = np.random.default_rng(seed)
    source = dice.uniform(-1.0, 1.0, (count, 3)) * reach
    own = Rotation.from_euler("ZYX", dice.uniform(-60.0, 60.0, (count, 3)), degrees=True)
    reference = FRAME.apply(source) + SHIFT + dice.normal(size=(count, 3)) * noise
    other = Rotation.from_rotvec(np.radians(dice.normal(size=(count, 3)) * turn)) * FRAME * own
    return source, reference, own, other


def fitted(source, reference, own, other, **options):
    ids = [f"S{row}" for row in range(len(source))]
    kinds = {"kind": "measured", "source_rotations": own, "reference_rotations": other, "effects": ()}
    return fit_spots(ids, source, reference, **{**kinds, **options})


def write(path, points, rotations=None):
    head = "id,x,y,z" + ("" if rotations is None else ",a,b,c")
    angles = np.empty((len(points), 0)) if rotations is None else rotations.as_euler("ZYX", degrees=True)
    rows = [
        f"S{row}," + ",".join(f"{value:.7f}" for value in numbers)
        for row, numbers in enumerate(np.hstack([points, angles]))
    ]
    path.write_text("\n".join([head, *rows]) + "\n")


@pytest.fixture
def lists(tmp_path):
    source, reference, own, other = made()
    write(tmp_path / "source.csv", source, own)
    write(tmp_path / "measured.csv", reference, other)
    write(tmp_path / "bare.csv", reference)
    return source, reference, own, other


COMMAND = ("fit", "source.csv", "--measured", "measured.csv", "--effects", "none")


def test_weights_by_direction(respot, lists, tmp_path):
    source, reference, *_ = lists
    even = respot(*COMMAND, "--json").json
    result = respot(*COMMAND, "--weights", "direction", "-o", "cal.json", "--json")
    assert result.code == 0, result.err
    there = fit_weighted(source, reference, [spot["inlier"] for spot in result.json["spots"]])
    transform, part = result.json["transform"], result.json["rigid_part"]
    np.testing.assert_allclose(transform["rotation"], there.rotation, atol=1e-8)
    np.testing.assert_allclose(list(transform["ci95"].values()), there.half_width, rtol=1e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(transform["covariance"])), there.half_width / T14, rtol=1e-5)
    np.testing.assert_allclose(part["noise"], there.noise, rtol=1e-5)
    assert (part["weights"], even["rigid_part"]["weights"]) == ("direction", "even")
    assert even["rigid_part"]["noise"] is None
    truth = FRAME.as_matrix()
    errors = [np.abs(np.array(each["transform"]["rotation"]) - truth).max() for each in (result.json, even)]
    assert errors[0] < errors[1]
    assert result.json["after"]["rms"] >= even["after"]["rms"]
    stored = Calibration.load(tmp_path / "cal.json")
    np.testing.assert_allclose(stored.precision.covariance, transform["covariance"], rtol=1e-9)
    assert stored.provenance["weights"] == "direction"
    words = respot(*COMMAND, "--weights", "direction").out
    assert "after: rigid, weighed by direction" in words
    assert "residuals count by a noise of" in words


def test_a_stored_calibration_with_weights_predicts_and_refuses_a_bootstrap(respot, lists):
    respot(*COMMAND, "--weights", "direction", "-o", "cal.json")
    assert respot("predict", "source.csv", "-c", "cal.json").code == 0
    refused = respot("predict", "source.csv", "-c", "cal.json", "--bootstrap", "200")
    assert refused.code == 2
    assert "one rigid least-squares fit" in refused.err


def test_orientations_are_fitted(respot, lists, tmp_path):
    source, reference, own, other = lists
    plain = respot(*COMMAND, "--json").json
    result = respot(*COMMAND, "--orientations", "fit", "-o", "cal.json", "--json")
    assert result.code == 0, result.err
    rows = np.flatnonzero([spot["inlier"] for spot in result.json["spots"]])
    there = fit_rigid_oriented(source[rows], reference[rows], own[rows], other[rows])
    np.testing.assert_allclose(result.json["transform"]["rotation"], there.rigid.rotation, atol=1e-8)
    part = result.json["rigid_part"]
    assert (part["orientations"], part["n_orientations"]) == ("fit", int(there.agree.sum()))
    assert part["sigma_deg"] == pytest.approx(0.03, rel=0.4)
    assert part["sigma_mm"] == pytest.approx(there.sigma_mm, rel=1e-4)
    wide, narrow = (each["transform"]["ci95"] for each in (plain, result.json))
    assert narrow["rx"] < wide["rx"] / 5.0
    assert narrow["rx"] == pytest.approx(T14 * 0.03 / np.sqrt(16), rel=0.5)
    assert narrow["tx"] == pytest.approx(2.14 * 0.3 / np.sqrt(16), rel=0.4)
    sd = np.sqrt(np.diag(result.json["transform"]["covariance"]))
    np.testing.assert_allclose(list(narrow.values()), T14 * sd, rtol=1e-5)
    stored = Calibration.load(tmp_path / "cal.json")
    np.testing.assert_allclose(stored.precision.covariance, result.json["transform"]["covariance"], rtol=1e-9)
    assert 3.0 * part["sigma_mm"] ** 2 == pytest.approx(np.trace(stored.precision.noise), rel=1e-6)
    words = respot(*COMMAND, "--orientations", "fit").out
    assert "after: rigid, orientations fitted too" in words
    assert "16 of 16 orientations took part" in words


@pytest.mark.parametrize(
    ("reference", "options", "words"),
    [
        ("bare.csv", ("--orientations", "fit"), "reference does not tell the orientation"),
        ("measured.csv", ("--orientations", "yes"), "--orientations is compare or fit"),
        ("measured.csv", ("--weights", "own"), "--weights is even or direction"),
        ("measured.csv", ("--weights", "direction", "--orientations", "fit"), "choose one"),
        ("measured.csv", ("--weights", "direction", "--method", "paper"), "paper has a transform of its own"),
        ("measured.csv", ("--orientations", "fit", "--method", "affine"), "affine has a transform of its own"),
    ],
)
def test_what_makes_no_sense_is_refused(respot, lists, reference, options, words):
    result = respot("fit", "source.csv", "--measured", reference, "--effects", "none", *options)
    assert result.code == 2
    assert words in result.err


def test_orientations_of_another_convention_are_not_fitted(respot, lists, tmp_path):
    source, reference, own, other = lists
    wrong = Rotation.from_euler("xyz", other.as_euler("ZYX", degrees=True), degrees=True)
    write(tmp_path / "measured.csv", reference, wrong)
    result = respot(*COMMAND, "--orientations", "fit")
    assert result.code == 2
    assert "orientations cannot be fitted" in result.err
    arguments = ("fit", "source.csv", "--measured", "measured.csv", "--effects", "convention", "--orientations", "fit")
    read_again = respot(*arguments, "--json")
    assert read_again.code == 0, read_again.err
    there = fit_rigid_oriented(source, reference, own, other)
    np.testing.assert_allclose(read_again.json["transform"]["rotation"], there.rigid.rotation, atol=1e-4)


def test_too_few_spots_for_weights(respot, tmp_path):
    source, reference, own, other = made(count=6, noise=(0.3, 0.3, 0.3))
    write(tmp_path / "source.csv", source, own)
    write(tmp_path / "measured.csv", reference, other)
    result = respot(*COMMAND, "--weights", "direction")
    assert result.code == 2
    assert "need 7" in result.err


def test_a_model_with_effects_is_fitted_evenly_and_says_so(respot, tmp_path):
    source, _, own, _ = made(count=18)
    dice = np.random.default_rng(2)
    reference = FRAME.apply(source + own.apply([3.0, -8.0, 12.0])) + SHIFT + dice.normal(0.0, 0.2, source.shape)
    write(tmp_path / "source.csv", source, own)
    write(tmp_path / "measured.csv", reference)
    arguments = ("fit", "source.csv", "--measured", "measured.csv", "--effects", "tool_offset", "--json")
    plain, result = respot(*arguments).json, respot(*arguments, "--weights", "direction").json
    assert [effect["name"] for effect in result["effects"]] == ["tool_offset"]
    assert result["transform"] == plain["transform"]
    assert result["rigid_part"]["weights"] == "even"
    (said,) = (issue for issue in result["issues"] if issue["code"] == "OPTION_UNUSED")
    assert "weights by direction are for a rigid transform alone" in said["message"]
    assert "OPTION_UNUSED" not in json.dumps(plain["issues"])


@pytest.mark.parametrize("options", [{"weights": "direction"}, {"orientations": "fit"}])
def test_leave_one_out_is_what_a_fit_without_the_spot_makes_of_it(options):
    source, reference, own, other = made()
    whole = fitted(source, reference, own, other, **options)
    assert whole.robust.inliers.all()
    for row in (0, 9):
        rest = np.flatnonzero(np.arange(len(source)) != row)
        part = fitted(source[rest], reference[rest], own[rest], other[rest], **options)
        predicted, _ = part.calibration.predict(source[[row]])
        np.testing.assert_allclose(whole.after_loo[row], predicted[0] - reference[row], atol=1e-9)


@pytest.mark.parametrize("options", [{"weights": "direction"}, {"orientations": "fit"}])
def test_leave_one_out_of_many_spots_is_close_to_that(options):
    source, reference, own, other = made(count=240)
    whole = fitted(source, reference, own, other, **options)
    inliers = whole.robust.inliers
    assert inliers.sum() > 200
    step = np.linalg.norm(whole.after_loo - whole.robust.rigid.residuals, axis=1)
    row = int(np.argmax(np.where(inliers, step, 0.0)))
    rest = np.flatnonzero(inliers & (np.arange(len(source)) != row))
    part = fitted(source[rest], reference[rest], own[rest], other[rest], **options)
    predicted, _ = part.calibration.predict(source[[row]])
    apart = np.linalg.norm(whole.after_loo[row] - (predicted[0] - reference[row]))
    assert apart < 0.1 * step[row]


def test_intervals_hold_with_fitted_orientations():
    held = []
    for seed in range(60):
        fit = fitted(*made(count=10, noise=(0.3, 0.3, 0.3), seed=seed), orientations="fit")
        model, sure = fit.calibration, fit.uncertainty
        centre = model.rotation.T @ (sure.centroid - model.translation)
        turn = np.degrees((FRAME * Rotation.from_matrix(model.rotation).inv()).as_rotvec())
        error = np.concatenate([FRAME.apply(centre) + SHIFT - sure.centroid, turn])
        held.append(np.abs(error) <= sure.half_width)
    assert 0.90 <= np.mean(held) <= 0.99


def test_a_list_without_orientations_is_named():
    source, reference, own, other = made()
    for which, rotations in (("source", (None, other)), ("reference", (own, None))):
        with pytest.raises(RegistrationError, match=which) as caught:
            fitted(source, reference, *rotations, orientations="fit")
        assert caught.value.code == "NO_ORIENTATION"
