"""How a solve of the real-time solver may end, and what is done about each ending."""

from __future__ import annotations

from enum import StrEnum

from turnscrew.estimate.pose_solution import BAD_DATA, Answer


class SqpStatus(StrEnum):
    """How a solve ended: at an optimum, nearly there, at a least violation, out of steps, or where daqp gave none."""

    CONVERGED = "converged"
    ACCEPTABLE = "acceptable"
    INFEASIBLE = "infeasible"
    MAX_ITERATIONS = "max iterations"
    STALLED = "stalled"
    OVERFLOW = "overflow"
    BAD_DATA = BAD_DATA
    QP_INFEASIBLE = "qp infeasible"
    QP_CYCLING = "qp cycling"
    QP_UNBOUNDED = "qp unbounded"
    QP_ITERATIONS = "qp iterations"
    QP_NONCONVEX = "qp not convex"
    QP_OVERDETERMINED = "qp start overdetermined"
    QP_TIME = "qp time"
    QP_UNKNOWN = "qp ended for another reason"


SQP_ANSWERS = {
    SqpStatus.CONVERGED: Answer.ACCEPT,
    SqpStatus.ACCEPTABLE: Answer.ACCEPT,
    SqpStatus.INFEASIBLE: Answer.NEXT_RUNG,
    SqpStatus.MAX_ITERATIONS: Answer.NEXT_RUNG,
    SqpStatus.STALLED: Answer.NEXT_RUNG,
    SqpStatus.OVERFLOW: Answer.NEXT_RUNG,
    SqpStatus.BAD_DATA: Answer.GIVE_UP,
    SqpStatus.QP_INFEASIBLE: Answer.NEXT_RUNG,
    SqpStatus.QP_CYCLING: Answer.NEXT_RUNG,
    SqpStatus.QP_UNBOUNDED: Answer.NEXT_RUNG,
    SqpStatus.QP_ITERATIONS: Answer.NEXT_RUNG,
    SqpStatus.QP_NONCONVEX: Answer.NEXT_RUNG,
    SqpStatus.QP_OVERDETERMINED: Answer.NEXT_RUNG,
    SqpStatus.QP_TIME: Answer.NEXT_RUNG,
    SqpStatus.QP_UNKNOWN: Answer.NEXT_RUNG,
}
"""Every status and its answer."""

QP_FLAGS = {
    -1: SqpStatus.QP_INFEASIBLE,
    -2: SqpStatus.QP_CYCLING,
    -3: SqpStatus.QP_UNBOUNDED,
    -4: SqpStatus.QP_ITERATIONS,
    -5: SqpStatus.QP_NONCONVEX,
    -6: SqpStatus.QP_OVERDETERMINED,
    -7: SqpStatus.QP_TIME,
}
"""daqp's exit flags below 1; 1 is an answer, and 2 one that violates a soft row."""
