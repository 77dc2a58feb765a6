"""How sure a calibration is, as a value that stays with it: what predictions need, and what fresh spots are held to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects import wrong_frame
from respot.calibration.region import outside
from respot.registration.covariance import jacobian
from respot.registration.statistics import rms

if TYPE_CHECKING:
    from respot.calibration.calibration import Calibration
    from respot.calibration.discovery.discover import Discovery
    from respot.calibration.spot_fit import SpotFit

Array = NDArray[np.float64]

_RIGID = 6
#: A spot is outside of the fitted ones where it leaves their hull by more than they scatter.
_MARGIN = 3.0
_SYMMETRIC = 1e-9


@dataclass(frozen=True, eq=False)
class Precision:
    """Covariance, noise and place of a fit.

    Attributes
    ----------
    covariance : (6 + k, 6 + k) array
        Of a left perturbation about ``centroid``, tx, ty, tz [mm] and rx, ry, rz [deg], all along the axes of the
        reference frame; then of the k parameters of the effects, a tool offset's in the tool's axes [mm].
    centroid : (3,) array
        Reference frame [mm].
    noise : (3, 3) array
        Covariance of the noise of one spot, along the axes of the reference frame [mm^2].
    degrees_of_freedom : float or None
        Of the size of the noise; None where that is known from elsewhere.
    regions : tuple of (n, 3) arrays
        The spots that each fit was fitted to, source frame [mm]: one array, and more of composed calibrations.
    residuals : (n, 3) array or None
        Predicted minus reference of the spots of the one region [mm]; None of composed calibrations.
    heldout_rms : float or None
        RMS of the errors of spots that took no part in fitting (leave-one-out over the inliers): what fresh
        measurements are held to [mm].
    heldout_n : int
        Of how many spots.
    effect_scatter : tuple of (3, 3) arrays
        For each effect of the model what it moves the fitted spots by, mean square along the axes of the reference
        frame [mm^2]: what a prediction without it does not know.
    unknown : (3, 3) array or None
        Mean square of the effects that are left out of a prediction, along the same axes [mm^2].

    Raises
    ------
    ValueError
        Shapes that do not belong together, numbers that are not finite, a covariance that is none.
    """

    covariance: Array
    centroid: Array
    noise: Array
    degrees_of_freedom: float | None
    regions: tuple[Array, ...]
    residuals: Array | None = None
    heldout_rms: float | None = None
    heldout_n: int = 0
    effect_scatter: tuple[Array, ...] = ()
    unknown: Array | None = None

    def __post_init__(self) -> None:
        covariance = _frozen(self.covariance)
        regions = tuple(_frozen(spots) for spots in self.regions)
        residuals = None if self.residuals is None else _frozen(self.residuals)
        square = covariance.ndim == 2 and covariance.shape[0] == covariance.shape[1] >= _RIGID
        if not square or np.shape(self.centroid) != (3,):
            raise ValueError("the covariance must be square, 6 x 6 or larger, and the centroid 3 numbers")
        if not regions or any(spots.ndim != 2 or spots.shape[1] != 3 or not len(spots) for spots in regions):
            raise ValueError("the spots it was fitted to must be n points of 3 numbers")
        if residuals is not None and (len(regions) != 1 or residuals.shape != regions[0].shape):
            raise ValueError("the residuals must be one for each spot")
        noise = _frozen(self.noise)
        if noise.shape != (3, 3):
            raise ValueError("the noise must be 3 x 3")
        for matrix, what in ((covariance, "covariance"), (noise, "noise")):
            if np.abs(matrix - matrix.T).max() > _SYMMETRIC * np.abs(matrix).max():
                raise ValueError(f"the {what} is not symmetric")
            if np.diag(matrix).min() < 0.0 or np.linalg.eigvalsh(_scaled(matrix)).min() < -_SYMMETRIC:
                raise ValueError(f"the {what} has a negative variance")
        free = self.degrees_of_freedom
        if free is not None and not 0.0 < free < np.inf:
            raise ValueError("the degrees of freedom must be positive")
        if self.heldout_rms is not None and not (0.0 <= self.heldout_rms < np.inf and self.heldout_n > 0):
            raise ValueError("the held-out RMS must be of some spots and not negative")
        values = {"covariance": covariance, "noise": noise, "regions": regions, "residuals": residuals}
        values["effect_scatter"] = tuple(_frozen(square) for square in self.effect_scatter)
        for name, value in {**values, "centroid": _frozen(self.centroid)}.items():
            object.__setattr__(self, name, value)

    @property
    def parameters(self) -> int:
        """6, and those of the effects."""
        return len(self.covariance)

    @property
    def sigma(self) -> float:
        """Noise per coordinate: RMS over the axes [mm]."""
        return float(np.sqrt(np.trace(self.noise) / 3.0))

    def covariance_of(self, calibrated: Array, columns: Array | None) -> Array:
        """Covariance (n, 3, 3) of predicted positions by the parameters alone, reference frame [mm^2].

        Parameters
        ----------
        calibrated : (n, 3) array
            Predicted positions, reference frame [mm].
        columns : (n, 3, k) array, or None
            Shift of each spot per unit of each parameter of the effects, reference frame (of a tool offset: the tool's
            orientation).

        Raises
        ------
        ValueError
            Other columns than there are parameters of effects.
        """
        rows = self.rows_of(calibrated, columns)
        result: Array = np.einsum("nik,kl,njl->nij", rows, self.covariance, rows)
        return result if self.unknown is None else result + self.unknown

    def rows_of(self, calibrated: Array, columns: Array | None) -> Array:
        """Shifts (n, 3, 6 + k) of predicted positions per unit of each parameter, reference frame.

        Parameters
        ----------
        calibrated, columns
            As `covariance_of`.

        Raises
        ------
        ValueError
            Other columns than there are parameters of effects.
        """
        rows = _rows(calibrated - self.centroid, columns)
        if rows.shape[2] != self.parameters:
            raise ValueError("the model has effects: their columns are needed, one for each parameter")
        return rows

    def leverage_of(self, covariance: Array) -> Array:
        """Leverage (n,): what the parameters add to the variance of a new spot, as a share of the noise's variance.

        Parameters
        ----------
        covariance : (n, 3, 3) array
            As `covariance_of` [mm^2].

        Returns
        -------
        (n,) array
            Mean over the three coordinates; 0 where there is no noise.
        """
        size = float(np.trace(self.noise))
        if size == 0.0:
            return np.zeros(len(covariance))
        result: Array = np.trace(covariance, axis1=1, axis2=2) / size
        return result

    def outside(self, points: Array) -> NDArray[np.bool_]:
        """Which source points (n, 3) lie outside the fitted spots of any region, by more than these scatter."""
        margin = _MARGIN * float(np.sqrt(max(np.linalg.eigvalsh(self.noise)[2], 0.0)))
        return np.asarray(np.any([outside(spots, points, margin) for spots in self.regions], axis=0), dtype=np.bool_)

    @property
    def direction_share(self) -> float:
        """How evenly the noise points, from 1/3 (all along one axis) to 1 (alike): `direction_share` of it."""
        return direction_share(self.noise)

    def inverted(self, model: Calibration) -> Precision:
        """Return the precision of the inverse of a rigid model, about the centroid in the source frame.

        ``inverse(P model) = inverse(model) inverse(P)``: a left perturbation of the inverse is the old one, turned
        round and seen in the source frame.
        """
        images = tuple(model.predict(spots)[0] for spots in self.regions)
        residuals = None
        if self.residuals is not None:  # the reference's own spots, so that the inverse of the inverse is this
            images, residuals = (images[0] - self.residuals,), -self.residuals @ model.rotation
        return replace(
            self,
            covariance=self._turned(model.rotation.T),
            centroid=(self.centroid - model.translation) @ model.rotation,
            noise=_symmetric(model.rotation.T @ self.noise @ model.rotation),
            regions=images,
            residuals=residuals,
        )

    def then(self, other: Precision, to_source: Calibration, to_last: Calibration) -> Precision:
        """Return the precision of two rigid models in a row: both covariances at the centroid of the second.

        The two fits are taken as independent; degrees of freedom by Welch and Satterthwaite.

        Parameters
        ----------
        other : Precision
            Of the second model.
        to_source : Calibration
            The inverse of the first model.
        to_last : Calibration
            The second model.
        """
        seen = to_last.predict(self.centroid[None, :])[0]
        move = jacobian(other.centroid - seen)[0]
        shift = np.eye(_RIGID)
        shift[:3, 3:] = move[:, 3:] * np.pi / 180.0
        covariance = shift @ self._turned(to_last.rotation) @ shift.T + other.covariance
        seen_noise = to_last.rotation @ self.noise @ to_last.rotation.T
        variance = self.sigma**2 + other.sigma**2
        share = sum(
            part.sigma**4 / part.degrees_of_freedom for part in (self, other) if part.degrees_of_freedom is not None
        )
        return Precision(
            covariance=_symmetric(covariance),
            centroid=other.centroid,
            noise=_symmetric(seen_noise + other.noise),
            degrees_of_freedom=variance**2 / share if share > 0.0 else None,
            regions=(*self.regions, *(to_source.predict(spots)[0] for spots in other.regions)),
        )

    def _turned(self, rotation: Array) -> Array:
        """Covariance of a rigid model along other axes."""
        turn = np.kron(np.eye(2), rotation)
        return _symmetric(turn @ self.covariance @ turn.T)

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "covariance": self.covariance.tolist(),
            "centroid": self.centroid.tolist(),
            "noise": self.noise.tolist(),
            "degrees_of_freedom": self.degrees_of_freedom,
            "fitted_spots": [spots.tolist() for spots in self.regions],
            "residuals": None if self.residuals is None else self.residuals.tolist(),
            **({"effect_scatter": [square.tolist() for square in self.effect_scatter]} if self.effect_scatter else {}),
            "heldout": None if self.heldout_rms is None else {"rms": self.heldout_rms, "n": self.heldout_n},
        }

    @classmethod
    def from_dict(cls, record: Mapping[str, Any]) -> Precision:
        """Read what `to_dict` made.

        Raises
        ------
        KeyError, TypeError, ValueError
            Entries that are missing or wrong.
        """
        free, residuals, heldout = record["degrees_of_freedom"], record["residuals"], record["heldout"]
        return cls(
            covariance=np.array(record["covariance"], dtype=np.float64),
            centroid=np.array(record["centroid"], dtype=np.float64),
            noise=np.array(record["noise"], dtype=np.float64),
            degrees_of_freedom=None if free is None else float(free),
            regions=tuple(np.array(spots, dtype=np.float64) for spots in record["fitted_spots"]),
            residuals=None if residuals is None else np.array(residuals, dtype=np.float64),
            heldout_rms=None if heldout is None else float(heldout["rms"]),
            heldout_n=0 if heldout is None else int(heldout["n"]),
            effect_scatter=tuple(np.array(square, dtype=np.float64) for square in record.get("effect_scatter", [])),
        )


def with_precision(fit: SpotFit) -> Calibration:
    """Return the calibration of a fit with its precision.

    The promise for fresh spots is the leave-one-out error over the inliers. Of the paper's method the spots are those
    of the chosen subset, which alone made the transform.

    Raises
    ------
    CalibrationError
        As `SpotFit.calibration`.
    """
    model = fit.calibration
    inliers = fit.robust.inliers
    rows: Sequence[int] = np.flatnonzero(inliers).tolist() if fit.paper is None else list(fit.paper.subset)
    heldout = fit.after_loo[inliers]
    heldout = heldout[np.isfinite(heldout).all(axis=1)]
    promise = rms(heldout) if len(heldout) else None
    sure = fit.uncertainty
    if fit.paper is None:
        residuals, turned = fit.robust.rigid.residuals[rows], None
        if model.tool_offset is not None and fit.source_rotations is not None:
            turned = Rotation.from_matrix(model.rotation) * fit.source_rotations[rows]
        if fit.discovery is not None and model.terms:
            precision = _with_effects(fit, fit.discovery, residuals)
        else:
            columns = None if turned is None else np.asarray(turned.as_matrix())
            precision = precision_of(fit.source[rows], fit.calibrated[rows], residuals, columns)
    else:  # the noise is that of all inliers, about another transform than the subset's: only its size is known
        noise, free = sure.sigma**2 * np.eye(3), float(sure.degrees_of_freedom)
        precision = Precision(sure.covariance, sure.centroid, noise, free, (fit.source[rows],))
    precision = replace(precision, heldout_rms=promise, heldout_n=len(heldout))
    return replace(model, precision=precision)


def _with_effects(fit: SpotFit, found: Discovery, residuals: Array) -> Precision:
    """Precision of a model with effects: the joint fit's covariance, and the scatter of what it leaves."""
    inliers = found.fit.inliers
    noise = _symmetric(3.0 * residuals.T @ residuals / found.fit.free)
    free = float(found.fit.free * direction_share(noise))
    centroid = fit.calibrated[inliers].mean(axis=0)
    scatter, start = [], 6
    for term, value in zip(found.fit.terms, found.fit.values, strict=True):
        stop = start + len(value)
        columns = found.fit.columns[inliers][:, :, start:stop] / found.fit.priors[start - 6 : stop - 6]
        shifts = columns @ value @ found.fit.rotation.T
        if term.effect == wrong_frame.NAME and fit.observations is not None:  # it has no parameter
            written = replace(fit.observations, positions=fit.source, rotations=fit.source_rotations)
            there = wrong_frame.at_frames(written, [term]).positions
            shifts = (there - fit.source)[inliers] @ found.fit.rotation.T
        scatter.append(_symmetric(shifts.T @ shifts / len(shifts)))
        start = stop
    return Precision(
        found.fit.covariance,
        centroid,
        noise,
        free,
        (fit.source[inliers],),
        residuals,
        effect_scatter=tuple(scatter),
    )


def precision_of(source: Array, calibrated: Array, residuals: Array, columns: Array | None = None) -> Precision:
    """Precision of the least-squares fit of some pairs, for noise that may differ by direction.

    With p parameters the noise is the scatter of the residuals, over n - p / 3; the covariance of the least-squares fit
    under such noise is ``A (sum J' noise J) A`` with ``A`` the inverse of ``sum J'J`` and J as `jacobian`. The size of
    the noise has ``(3n - p) * direction_share(noise)`` degrees of freedom. Against noise that is taken as alike in all
    directions this costs next to nothing where it is alike, and balls hold their share where it is not.

    Parameters
    ----------
    source, calibrated : (n, 3) arrays, 3n > p
        The pairs it was fitted to, source frame; and predicted, reference frame [mm].
    residuals : (n, 3) array
        Predicted minus reference [mm].
    columns : (n, 3, p - 6) array, optional
        Of a fit with effects: shift of each spot per unit of their parameters, reference frame; of a tool offset the
        tool's orientations.
    """
    centroid = calibrated.mean(axis=0)
    rows = _rows(calibrated - centroid, columns)
    size = rows.shape[2]
    free = 3 * len(source) - size
    noise = _symmetric(3.0 * residuals.T @ residuals / free)
    # columns of like size: a metre of offset makes degrees outweigh millimetres by far
    scale = np.sqrt(np.einsum("nik,nik->k", rows, rows))
    even = rows / scale
    unit = np.linalg.inv(np.einsum("nik,nil->kl", even, even))
    covariance = unit @ np.einsum("nik,ij,njl->kl", even, noise, even) @ unit / np.outer(scale, scale)
    return Precision(_symmetric(covariance), centroid, noise, free * direction_share(noise), (source,), residuals)


def _rows(offsets: Array, columns: Array | None) -> Array:
    """Shifts (n, 3, p) of points at offsets (n, 3) from the centroid [mm] by each parameter [mm, deg, ...]."""
    rigid = jacobian(offsets)
    rigid[:, :, 3:] *= np.pi / 180.0
    return rigid if columns is None else np.concatenate([rigid, columns], axis=2)


def direction_share(noise: Array) -> float:
    """How evenly noise points, from 1/3 (all along one axis) to 1 (alike): Box's factor for sums of squares.

    Sums of squares of n vectors scatter as chi-square with 3n times this many degrees of freedom (G. E. P. Box, Ann.
    Math. Statist. 25 (1954), 290).

    Parameters
    ----------
    noise : (3, 3) array
        Covariance [mm^2].
    """
    size = float(np.sum(noise**2))
    return float(np.trace(noise) ** 2 / (3.0 * size)) if size > 0.0 else 1.0


def _symmetric(matrix: Array) -> Array:
    result: Array = (matrix + matrix.T) / 2.0
    return result


def _frozen(values: Array) -> Array:
    result = np.array(values, dtype=np.float64) + 0.0
    if not np.isfinite(result).all():
        raise ValueError("a number is not finite")
    result.setflags(write=False)
    return result


def _scaled(covariance: Array) -> Array:
    """Correlations; a parameter without variance has none."""
    sd = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    sd[sd == 0.0] = 1.0
    result: Array = covariance / np.outer(sd, sd)
    return result
