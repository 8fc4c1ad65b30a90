"""The commands `turnscrew study ...`: questions put to many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from turnscrew.cli.options import JobsOption, SetOption, TablesOption, wide_console

study_app = typer.Typer(help="Questions put to many runs.", no_args_is_help=True)

SeedsOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of the first run; the next one has the next.")]


@study_app.command()
def estimation(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of runs.")],
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Measure the runs again with other sensors; repeatable."),
    ] = None,
    variants: Annotated[
        list[str] | None, typer.Option("--variant", help="Estimate by this one only; repeatable. All without.")
    ] = None,
    noise: Annotated[bool, typer.Option("--noise", help="Also against the synthetic camera's noise.")] = False,
    distance: Annotated[bool, typer.Option("--distance", help="Also against the rendered camera's distance.")] = False,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/study"),
) -> int:
    """Estimate recorded runs again, by each part of the method, and compare with the truth."""
    from turnscrew.show.estimation_report import report
    from turnscrew.study.estimation.study import cases, chosen, parts

    todo = parts(runs, cases(overrides or [], noise=noise, distance=distance), chosen(variants), out)
    report(todo, jobs, out, wide_console())
    return 0


@study_app.command()
def solvers(
    runs: Annotated[
        list[Path] | None, typer.Argument(metavar="RUN...", help="Folders of runs, whose frames are solved again.")
    ] = None,
    random: Annotated[
        int, typer.Option("--random", metavar="N", min=0, help="Random frames for each of 2, 3 and 4 fingers; 0: none.")
    ] = 1000,
    seed: Annotated[int, typer.Option("--seed", min=0, help="What is random is drawn from it.")] = 0,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes at a time; more than one blur the times.")] = 1,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the tables go.")] = Path("runs/solvers"),
) -> int:
    """Compare the solvers of the tool's pose: the exact but slow one, the fast one, and the filter's correction."""
    from turnscrew.show.solver_report import report
    from turnscrew.study.solvers.study import parts

    report(parts(runs or [], random, seed, out), jobs, out, wide_console())
    return 0


@study_app.command()
def faults(
    n: Annotated[int, typer.Option("--n", min=1, help="Runs of each kind of fault.")] = 10,
    seed: SeedsOption = 0,
    overrides: SetOption = None,
    kinds: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="KIND",
            help="This kind only: nothing, dark, flipped, dark-short, nan, frozen, silent; repeatable.  All without.",
        ),
    ] = None,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/faults"),
) -> int:
    """Let a sensor fail in the middle of a run: how far off the robot's idea of the tool gets, and how the run ends."""
    from turnscrew.show.faults_report import report
    from turnscrew.study.faults.study import chosen, parts

    report(parts(chosen(kinds), n, seed, overrides or [], out), jobs, out, wide_console())
    return 0


@study_app.command()
def slips(
    n: Annotated[
        int, typer.Option("--n", min=0, help="Runs in which the tip is made to slip, of each of two kinds.")
    ] = 10,
    quiet: Annotated[int, typer.Option("--quiet", min=0, help="Runs without slips, to count false alarms in.")] = 10,
    seed: SeedsOption = 0,
    overrides: SetOption = None,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/slips"),
) -> int:
    """Make the screwdriver's tip slip: how soon the robot notices, and how often it is wrong."""
    from turnscrew.show.slips_report import report
    from turnscrew.study.slips.study import parts

    report(parts(n, quiet, seed, overrides or [], out), jobs, out, wide_console())
    return 0


@study_app.command(name="finger-slips")
def finger_slips(
    n: Annotated[
        int,
        typer.Option("--n", min=0, help="Seeds with slick fingers; each runs with the robot's reaction and without."),
    ] = 10,
    quiet: Annotated[int, typer.Option("--quiet", min=0, help="Runs without, to count false alarms in.")] = 10,
    factor: Annotated[
        float, typer.Option("--factor", min=0.01, max=1.0, help="What a slick finger's friction is multiplied by.")
    ] = 0.3,
    seed: SeedsOption = 0,
    overrides: SetOption = None,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/finger-slips"),
) -> int:
    """Let single fingers lose their friction for .3 s: how soon the robot notices, and what its squeezing saves."""
    from turnscrew.show.finger_slips_report import report
    from turnscrew.study.finger_slips.study import parts

    report(parts(n, quiet, factor, seed, overrides or [], out), jobs, out, wide_console())
    return 0


@study_app.command(name="envelope")
def give_way(
    grips: Annotated[
        list[str] | None,
        typer.Option("--grasp", help='Of "TH+MF", "FF+RF" and "all four" this one only; repeatable.'),
    ] = None,
    forces: Annotated[
        list[str] | None,
        typer.Option("--forces", help='Of "surest" and "controller" this choice of contact forces only; repeatable.'),
    ] = None,
    radius: Annotated[
        list[float] | None, typer.Option("--radius", help="Handles of this radius instead [m]; repeatable.")
    ] = None,
    friction: Annotated[
        list[float] | None, typer.Option("--friction", help="Friction of a fingertip on them; repeatable. 1 without.")
    ] = None,
    squeeze: Annotated[float, typer.Option("--squeeze", metavar="N", help="Their largest squeeze [N].")] = 12.0,
    torque: Annotated[
        float | None, typer.Option("--at", metavar="N.m", help="Also tell how the grasps stand at this torque.")
    ] = None,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/envelope-study"),
) -> int:
    """Put grasps into the simulated cell, raise the torque until they give way, and compare with what was predicted.

    Without --radius it takes 14 combinations of radius, friction and squeeze.
    """
    from turnscrew.show.give_way_report import report
    from turnscrew.study.envelope.study import COMBINATIONS, chosen_forces, chosen_grips, parts

    chosen = [(r, mu, squeeze) for r in radius or () for mu in friction or (1.0,)]
    todo = parts(chosen or COMBINATIONS, chosen_grips(grips), chosen_forces(forces), out)
    report(todo, jobs, out, wide_console(), torque)
    return 0


@study_app.command()
def stability(
    overrides: SetOption = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the runs and of their disturbances.")] = 0,
    gain_map: Annotated[
        bool, typer.Option("--map/--no-map", help="Also the map of stable gains: natural frequency against delay.")
    ] = True,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/stability"),
) -> int:
    """Tell how late commands may come, or how stiff the control may be, before a held tool begins to swing."""
    from turnscrew.show.stability_report import report
    from turnscrew.study.stability.study import parts

    report(parts(overrides or [], seed, with_map=gain_map, out=out), jobs, out, wide_console())
    return 0


@study_app.command()
def actuation(
    n: Annotated[int, typer.Option("--n", min=1, help="Runs of each arm under each condition.")] = 10,
    seed: SeedsOption = 0,
    overrides: SetOption = None,
    conditions: Annotated[
        list[str] | None,
        typer.Option(
            "--condition",
            metavar="NAME",
            help="Under this one only: nothing, pushes, mass, friction, all (three at once); repeatable.",
        ),
    ] = None,
    arms: Annotated[
        list[str] | None,
        typer.Option(
            "--arm",
            metavar="NAME",
            help="This robot only: torque (joints take torques, fingers squeeze as little as holds), fixed (torques, "
            "the same squeeze at all times), position (joints take positions); repeatable.",
        ),
    ] = None,
    squeezes: Annotated[
        list[float] | None,
        typer.Option(
            "--squeeze",
            metavar="N",
            help="Squeeze of each finger in the arm 'fixed' [N]; repeatable.  8 and 10 without.",
        ),
    ] = None,
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/actuation"),
) -> int:
    """Turn the same screws by joint torques and by joint positions, with the handle pushed and the model wrong."""
    from turnscrew.show.actuation_report import report
    from turnscrew.study.actuation.conditions import chosen_arms, chosen_conditions
    from turnscrew.study.actuation.study import parts

    chosen = chosen_conditions(conditions), chosen_arms(arms, squeezes or (8.0, 10.0))
    report(parts(*chosen, n, seed, overrides or [], out), jobs, out, wide_console())
    return 0


@study_app.command()
def ablation(
    n: Annotated[int, typer.Option("--n", min=1, help="Trials without each measure.")] = 40,
    seed: SeedsOption = 0,
    overrides: SetOption = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            metavar="MEASURE",
            help='This one only: "all measures" (nothing taken away), refinement, "guarded contacts", re-centring, '
            '"force integral", "growing squeeze"; repeatable.  All without.',
        ),
    ] = None,
    variation: Annotated[
        str, typer.Option("--variation", help="As `turnscrew trials` has it: standard, hard or none.")
    ] = "standard",
    jobs: JobsOption = 1,
    out: TablesOption = Path("runs/ablation"),
) -> int:
    """Take away what makes the finger gait robust, one measure at a time: how many screws are driven without it."""
    from turnscrew.show.ablation_report import report
    from turnscrew.study.ablation.measures import chosen
    from turnscrew.study.ablation.study import parts
    from turnscrew.task.scenario import load

    measures = chosen(without, load(None, overrides or []))
    report(parts(measures, overrides or [], variation, range(seed, seed + n), out), measures, jobs, out, wide_console())
    return 0
