"""The search for a drive that the tip has left, from a scenario."""

from __future__ import annotations

from turnscrew.decide.felt_force import FeltForce
from turnscrew.decide.gait import Gait
from turnscrew.decide.placing import Placing
from turnscrew.decide.plan import GaitPlan
from turnscrew.decide.reseat import Reseat
from turnscrew.decide.reseat_gather import Gathering
from turnscrew.decide.reseat_search import Search
from turnscrew.decide.reseat_walk import AirWalk
from turnscrew.robot.model import RobotModel
from turnscrew.task.scenario_keys import Scenario

IN_AIR = 1.0
"""Fastest turning of a handle in the air [rad/s]: nothing but the camera tells how it swings meanwhile, and a
frame errs by 4 mm."""

CLEAR = 0.005
"""Distance from it at which fingers begin to feel for it then [m]: the handle errs by 2 mm, not by .5 mm."""


def build_reseat(scenario: Scenario, plan: GaitPlan, robot: RobotModel) -> Reseat:
    """The search, told what it is to look for."""
    gathering = Gathering(robot, plan)
    # at the usual pace, however fast the gait is on the screw, and on servos or on springs that are like them
    in_air = Gait(plan, Placing(robot, plan), min(scenario.speed.turning, IN_AIR), standoff=CLEAR, recentre=False)
    search = Search(FeltForce(robot), scenario.tool.blade_width, scenario.screw.slot_depth)
    return Reseat(robot, gathering, AirWalk(in_air, gathering, scenario.screw.slot_yaw), search)
