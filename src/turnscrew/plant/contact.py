"""Contact settings under which a held grasp does not creep."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

SOLREF = (0.005, 1.0)
"""Time constant [s] and damping ratio of a contact: five plant steps, the stiffest that 1 kHz integrates cleanly."""

SOLIMP = (0.95, 0.99, 0.0005, 0.5, 2.0)
"""Impedance rises to .99 within .5 mm: about .16 mm of indentation at 10 N, as a firm rubber fingertip gives."""

STEEL = (0.99, 0.999, 0.0005, 0.5, 2.0)
"""The same for blade in slot, ten times as stiff: the softer values let the blade twist by 4 deg at .05 N.m."""

IMPRATIO = 100.0
"""Friction's impedance over the normal's, with the elliptic cone: at 10 a held tool creeps by millimetres in
seconds, at 1 the grasp is lost (found by trial; MuJoCo issue 3328 tells the same)."""

NOSLIP = 3
"""Iterations of MuJoCo's second friction pass: without it a grasp held for 20 s creeps by .5 deg, with three by less
than .1 deg, for a tenth more time a step.  Near the end of their friction fingertips creep all the same, by .5 mm/s at
.85 of it; with thirty passes by a tenth of that."""

TORSION = 0.002
"""Torsional friction of a fingertip's contact patch [m]: about 2/3 of a patch radius of 3 mm times friction 1,
the flat-punch formula `2/3 mu a` for a soft fingertip."""


@dataclass(frozen=True)
class Friction:
    """Friction coefficients of the two kinds of contact.

    Attributes:
        finger: Fingertip skin on the handle.
        tip: Blade on the screw's drive, steel on steel.
    """

    finger: float
    tip: float


def rub(geom: mujoco.MjsGeom, sliding: float, priority: int = 1, solimp: tuple[float, ...] = SOLIMP) -> None:
    """Sets a geom's contact properties.

    Args:
        geom: The geom.
        sliding: Coulomb coefficient.
        priority: Of two geoms that touch, the one with the higher priority decides.
        solimp: Impedance.
    """
    geom.priority = priority
    geom.condim = 4
    geom.friction = [sliding, TORSION * sliding, 0.0]
    geom.solref, geom.solimp = SOLREF, solimp
    geom.margin = 0.0


def set_solver(spec: mujoco.MjSpec, timestep: float, passes: int = NOSLIP) -> None:
    """Integrator and contact solver of the plant; a dense Jacobian is the faster one below 60 degrees of freedom.

    Bodies carry one to three shapes each: trees of bounding boxes over them (the midphase) cost more than they save.
    """
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.impratio = IMPRATIO
    option.noslip_iterations = passes
    # a state that diverges must be seen, not silently set back to the start
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_MIDPHASE
