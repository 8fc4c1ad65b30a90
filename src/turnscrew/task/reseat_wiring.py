"""The search for a drive that the tip has left, from a scenario."""

from __future__ import annotations

from dataclasses import replace

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

SLOW_FOLLOW, SLOW_TAPPED = 2.0, 0.0004
"""Of the search with torques, whose arm has a loop of 10 rad/s instead of 45: how fast it follows [1/s], and how far it
taps [m]: pressed by half a newton too much, with .3 mm the tip keeps a share of its load; with .5 mm it hops."""

SLOW_SOFT, SLOW_MOST = 0.006, 1.4
"""And how fast it gives way to a force [m/s/N], and what it pulls with at most [N]: it goes on for a while after it is
told to stop, and pulled the blade out over the slot's end."""


def build_reseat(scenario: Scenario, plan: GaitPlan, robot: RobotModel) -> Reseat:
    """The search, told what it is to look for."""
    gathering = Gathering(robot, plan)
    # at the usual pace, however fast the gait is on the screw, and on servos or on springs that are like them
    in_air = Gait(plan, Placing(robot, plan), min(scenario.speed.turning, IN_AIR), standoff=CLEAR, recentre=False)
    search = Search(FeltForce(robot), scenario.tool.blade_width, scenario.screw.slot_depth)
    if scenario.robot.actuation == "torque":
        search = replace(search, follow=SLOW_FOLLOW, tapped=SLOW_TAPPED, soft=SLOW_SOFT, most=SLOW_MOST)
    return Reseat(robot, gathering, AirWalk(in_air, gathering, scenario.screw.slot_yaw), search)
