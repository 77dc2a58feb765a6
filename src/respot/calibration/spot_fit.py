"""Everything that a fit of paired spots found, as one value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.discovery.discover import Discovery
from respot.calibration.effects.convention import ConventionTrial
from respot.calibration.effects.effect import Effect
from respot.calibration.effects.orientations import OrientationFit
from respot.calibration.effects.tool_offset import ToolTrial
from respot.calibration.observations import Observations
from respot.calibration.uncertainty import TransformUncertainty
from respot.registration.affine import AffineFit
from respot.registration.alternatives import TranslationFit
from respot.registration.anisotropy import WeightedFit
from respot.registration.exchanged import ExchangeResult
from respot.registration.matching import IdMatch
from respot.registration.oriented import OrientedFit
from respot.registration.pairing import Note
from respot.registration.paper import PaperFit
from respot.registration.rigid import RigidFit
from respot.registration.robust import RobustFit
from respot.registration.statistics import ResidualDirections
from respot.registration.support import RotationSupport

if TYPE_CHECKING:
    from respot.calibration.holdout import HeldOutSpots

Array = NDArray[np.float64]
Method = Literal["robust", "paper", "affine"]
Weights = Literal["even", "direction"]
"""What a residual counts in the final rigid fit: the same along all axes, or by the noise of its direction."""
Orientations = Literal["compare", "fit"]
"""Tool orientations are compared after the fit, or fitted with the positions."""


@dataclass(frozen=True, eq=False)
class SpotFit:
    """Everything that a fit of n pairs found. All lengths mm, all residuals predicted minus reference.

    Attributes
    ----------
    model : Calibration
        The rigid model. Of the method "affine", which has none, it is ours; ask for `calibration`.
    match : IdMatch or None
        How the pairs were formed, where two lists were given.
    ids, reference_ids : tuples of n str
        Name of each pair in the source; name of the reference spot it belongs to, repaired.
    source, reference : (n, 3) arrays
        Source spots; the reference spots they belong to, names repaired.
    source_rotations : Rotation of n, or None
    as_found : (n, 3) array
        Source minus reference as named.
    before : RigidFit
        Least squares of all pairs as named.
    before_loo, after_loo : (n, 3) arrays
        Leave-one-out residuals as named; and of the final structure (an outlier is judged by the fit of the inliers).
    exchanged : ExchangeResult
    robust : RobustFit
        Inliers, scale, and ``rigid``: the final least-squares fit.
    affine : AffineFit or None
        The unconstrained 12 parameters over all pairs as named; None for coplanar spots.
    translation : TranslationFit
        Translation alone, over the inliers with names repaired.
    directions : ResidualDirections
        Of the inliers.
    support : RotationSupport
    uncertainty : TransformUncertainty
    effects : tuple of Effect
    noise : float or None
        Noise per coordinate known from elsewhere.
    method : "robust", "paper" or "affine"
        What the final model is made by. Of "paper" and "affine" no name is ever repaired; "affine" changes nothing but
        this word and ``beside``: its model is the field ``affine``.
    paper : PaperFit or None
        Of the method "paper": what was chosen; ``robust`` then holds its transform, and as inliers all within tau.
    paper_mean_square : PaperFit or None
        Of the method "paper": the same with the other reading of the variance, for comparison.
    beside : SpotFit or None
        Our robust fit of the same pairs, of any other method.
    notes : tuple of Note
        What was noticed while pairing.
    tool : ToolTrial or None
        What became of the effect ``tool_offset``, where it was tried. Accepted, it is part of the model: ``robust`` is
        then the fit of `moved`, and ``uncertainty.covariance`` (9, 9) has the offset's three parameters last.
    orientations : OrientationFit or None
        How tool orientations compare, where source and reference have them.
    discovery : Discovery or None
        The search for all other effects, where there was one. Where ``model.terms`` are its terms, ``robust`` is the
        fit of `moved`, and ``uncertainty.covariance`` has their parameters last.
    observations : Observations or None
        What it saw.
    convention : ConventionTrial or None
        Whether a list writes its orientations in another way, where that was asked.
    noise_source : str or None
        Where ``noise`` is known from: ``"--noise"`` or ``"repeats"``.
    kind_of_search : "all" or "some"
        Whether all effects were looked for, or some by their names.
    weighted : WeightedFit or None
        The final rigid fit, where each direction was weighed by its own noise; ``robust.rigid`` is its transform.
    oriented : OrientedFit or None
        The final rigid fit of the inliers, where orientations were fitted with positions; likewise.
    heldout : HeldOutSpots or None
        Spots that were kept out of all of this from the start, and their errors.
    """

    model: Calibration
    match: IdMatch | None
    ids: tuple[str, ...]
    reference_ids: tuple[str, ...]
    source: Array
    reference: Array
    source_rotations: Rotation | None
    as_found: Array
    before: RigidFit
    before_loo: Array
    after_loo: Array
    exchanged: ExchangeResult
    robust: RobustFit
    affine: AffineFit | None
    translation: TranslationFit
    directions: ResidualDirections
    support: RotationSupport
    uncertainty: TransformUncertainty
    effects: tuple[Effect, ...]
    noise: float | None
    method: Method = "robust"
    paper: PaperFit | None = None
    paper_mean_square: PaperFit | None = None
    beside: SpotFit | None = None
    notes: tuple[Note, ...] = ()
    tool: ToolTrial | None = None
    orientations: OrientationFit | None = None
    discovery: Discovery | None = None
    observations: Observations | None = None
    convention: ConventionTrial | None = None
    noise_source: str | None = None
    kind_of_search: Literal["all", "some"] = "some"
    weighted: WeightedFit | None = None
    oriented: OrientedFit | None = None
    heldout: HeldOutSpots | None = None

    @property
    def calibration(self) -> Calibration:
        """The final model.

        Raises
        ------
        CalibrationError
            ``CALIBRATION_NOT_RIGID`` for the method "affine".
        """
        if self.method == "affine":
            raise CalibrationError(
                "CALIBRATION_NOT_RIGID",
                "the unconstrained solution is no rigid motion: it shears and stretches the part, and no program can "
                "be corrected by it",
            )
        return self.model

    @property
    def reference_as_named(self) -> Array:
        """Reference spots (n, 3) by the names as given [mm]."""
        named = np.empty_like(self.reference)
        named[self.exchanged.permutation] = self.reference
        return named

    @property
    def reference_ids_as_named(self) -> tuple[str, ...]:
        """Name of each pair in the reference, as given."""
        names = dict(zip(self.exchanged.permutation.tolist(), self.reference_ids, strict=True))
        return tuple(names[row] for row in range(len(self.ids)))

    @property
    def moved(self) -> Array:
        """Source spots (n, 3) with the effects of the model, source frame [mm]: what the rigid part turns."""
        if self.model.terms and self.discovery is not None:
            return self.discovery.fit.moved
        if self.tool is None or self.tool.fit is None or not self.tool.accepted:
            return self.source
        return self.tool.fit.moved

    @property
    def rereads_source(self) -> bool:
        """Whether the source's orientations are taken for another convention than they were read in."""
        found = None if self.convention is None else self.convention.finding
        return found is not None and found.side == "source" and found.effect.named

    @property
    def calibrated_rotations(self) -> Rotation | None:
        """Tool orientations under the final model, reference frame; None where the source has none."""
        turned = self.source_rotations
        if self.model.terms and self.discovery is not None:
            turned = self.discovery.fit.rotations
        return None if turned is None else Rotation.from_matrix(self.model.rotation) * turned

    @property
    def calibrated(self) -> Array:
        """Source spots under the final model (n, 3), reference frame [mm]."""
        return self.robust.rigid.predict(self.moved)

    @property
    def repaired(self) -> NDArray[np.bool_]:
        """Which pairs (n,) got another name than they came with."""
        changed: NDArray[np.bool_] = self.exchanged.permutation != np.arange(len(self.ids))
        return changed
