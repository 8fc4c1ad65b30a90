"""What the pose may be estimated from: the camera alone, then one constraint of III-A after the other, then all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.pose_problem import Tolerances
from turnscrew.estimate.pose_refine import PoseRefiner
from turnscrew.estimate.reference import Reference

NEVER = 10.0
"""A bound that a sine, or a contact's way on the handle in radians and centimetres, never reaches."""

NOTHING = 1e-9
"""A doubt so small that the filter learns nothing of a constant."""


@dataclass(frozen=True)
class Variant:
    """One way to the pose.

    Attributes:
        name: As it stands in tables and plots.
        meaning: In a sentence.
        change: Makes the estimator of it; None where the pose can be read from the estimator as it is.
    """

    name: str
    meaning: str
    change: Callable[[ToolEstimator], ToolEstimator] | None = None


def _from_camera(tolerances: Tolerances) -> Callable[[ToolEstimator], ToolEstimator]:
    def change(estimator: ToolEstimator) -> ToolEstimator:
        refiner = replace(estimator.refiner or PoseRefiner(), tolerances=tolerances)
        return replace(estimator, refiner=refiner, reference=Reference.CAMERA)

    return change


def _as_printed(estimator: ToolEstimator) -> ToolEstimator:
    """III-A on the kinematics as they are: hand-to-screw offset, radius and encoder offsets stay what was said."""
    doubtless = Prior(screw=(NOTHING,) * 3, radius=NOTHING, offset=NOTHING, coupling=None)
    constant = replace(estimator.filter, constants_drift=0.0, offset_drift=0.0)
    return replace(_from_camera(Tolerances())(estimator), prior=doubtless, filter=constant)


VARIANTS = (
    Variant("camera", "the camera's frame against the truth at its exposure"),
    Variant("(1)", "the tip put into the screw's drive, the camera's orientation"),
    Variant("(1)-(2)", "and fingertips and handle meet", _from_camera(Tolerances(eps2=NEVER, step=NEVER))),
    Variant("(1)-(4)", "and their tangent planes agree", _from_camera(Tolerances(step=NEVER))),
    Variant("(1)-(5)", "and contacts stay near where rolling predicts them: the paper's problem, on learned constants",
            _from_camera(Tolerances())),
    Variant("(1)-(5) unlearned", "the paper's problem on uncorrected kinematics", _as_printed),
    Variant("MAP", "the filter: camera, tip and contacts weighed by their noise, over all frames"),
    Variant("loop", "what the loop uses: the paper's problem with the filter's orientation as rbar"),
)  # fmt: skip
"""In the order of the table; those without a change are read from one run of the estimator as the scenario has it."""
