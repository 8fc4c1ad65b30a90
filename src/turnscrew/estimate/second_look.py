"""A second look at jerks of the forces: a slip of the tip is named when the blade's play does not explain them.

What the walls of the slot do to a blade that has crossed its play is over within some ticks, and shows only then.  So a
jerk is left in doubt for a while; whether it was a slip is decided by what it has left behind.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from turnscrew.estimate.blade_play import BladePlay, PlayState
from turnscrew.geometry.arrays import Array
from turnscrew.values import changed


@dataclass(frozen=True, slots=True)
class LookState:
    """What is remembered.

    Attributes:
        play: Of the blade in its slot.
        doubted: Time since the forces jerked enough for a slip [s]; 0 while they have not.
        peak: Largest evidence of a slip since then.
        excused: Time for which jerks will still be put down to the blade's play [s].
    """

    play: PlayState
    doubted: float = 0.0
    peak: float = 0.0
    excused: float = 0.0


@dataclass(frozen=True, slots=True)
class SecondLook:
    """Parameters.

    Attributes:
        play: Tells whether the blade crosses its play.
        look: Time for which a jerk is left in doubt [s]: what a slip itself does to the torque lasts three ticks, and a
            slip is to be named within .1 s.
        calm: Time for which a blade that has crossed its play may hop on [s]: it stays free for .1 s in a fast gait.
    """

    play: BladePlay = field(default_factory=BladePlay)
    look: float = 0.06
    calm: float = 0.15

    def init(self) -> LookState:
        """Nothing in doubt."""
        return LookState(self.play.init())

    def felt(self, state: LookState, f_W: Array, arm: Array, axis: Array, turned: float, dt: float) -> LookState:
        """Takes in the readings of a tick; arguments as in `BladePlay.update`."""
        return changed(state, play=self.play.update(state.play, f_W, arm, axis, turned, dt))

    def judged(
        self, state: LookState, forces: float, eye: float, moved: float, h: float, dt: float
    ) -> tuple[LookState, float]:
        """What the evidence of a tick is worth.

        Args:
            state: Its readings taken in.
            forces: Evidence by the forces, which the blade's play may explain,
            eye: by the camera,
            moved: and by the fingers' motion, which comes on top of either; neither needs a second look.
            h: Evidence that names a slip.
            dt: Time since the last tick [s].

        Returns:
            The new state, and the evidence that counts.  While `excused` is above zero the forces tell nothing.
        """
        alone, together = eye + moved, max(forces, eye) + moved
        if state.excused > 0.0:
            # a blade that still hops is still free
            left = self.calm if together >= h else max(state.excused - dt, 0.0)
            return changed(state, excused=left), alone
        looked = state.doubted >= self.look
        if together < h and (looked or state.doubted == 0.0):
            return changed(state, doubted=0.0, peak=0.0), together
        state = changed(state, doubted=state.doubted + dt, peak=max(state.peak, together))
        if looked:
            return state, together
        if state.doubted < self.look:
            return state, alone
        if self.play.crossed(state.play, dt):
            return changed(state, doubted=0.0, peak=0.0, excused=self.calm), alone
        return state, state.peak
