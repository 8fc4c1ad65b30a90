"""How a solve of the real-time solver may end, and what is done about each ending."""

from __future__ import annotations

from enum import StrEnum

from turnscrew.estimate.pose_model import ENDLESS, OVERFLOWN
from turnscrew.estimate.pose_solution import BAD_DATA, Answer


class SqpStatus(StrEnum):
    """How a solve ended: at an optimum, nearly there, at a least violation, out of steps, or where a model had none."""

    CONVERGED = "converged"
    ACCEPTABLE = "acceptable"
    INFEASIBLE = "infeasible"
    MAX_ITERATIONS = "max iterations"
    STALLED = "stalled"
    OVERFLOW = "overflow"
    BAD_DATA = BAD_DATA
    QP_ITERATIONS = "qp iterations"


SQP_ANSWERS = {
    SqpStatus.CONVERGED: Answer.ACCEPT,
    SqpStatus.ACCEPTABLE: Answer.ACCEPT,
    SqpStatus.INFEASIBLE: Answer.NEXT_RUNG,
    SqpStatus.MAX_ITERATIONS: Answer.NEXT_RUNG,
    SqpStatus.STALLED: Answer.NEXT_RUNG,
    SqpStatus.OVERFLOW: Answer.NEXT_RUNG,
    SqpStatus.BAD_DATA: Answer.GIVE_UP,
    SqpStatus.QP_ITERATIONS: Answer.NEXT_RUNG,
}
"""Every status and its answer."""

MODEL_ENDS = {ENDLESS: SqpStatus.QP_ITERATIONS, OVERFLOWN: SqpStatus.OVERFLOW}
"""How a model may end that gives no step."""
