"""Where the trials of a study are made: on this machine, or on a Ray cluster."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from turnscrew.errors import ScenarioError
from turnscrew.study.parts import Done, Engine

ENGINES = ("joblib", "ray")


def engine(name: str) -> Engine | None:
    """An engine by name; none is the processes of this machine.

    Raises:
        ScenarioError: There is no such engine, or what it needs is missing.
    """
    if name not in ENGINES:
        raise ScenarioError(f"--engine {name}: must be one of {', '.join(ENGINES)}")
    if name == "joblib":
        return None
    if importlib.util.find_spec("ray") is None:
        raise ScenarioError("--engine ray: Ray is not installed; pip install 'turnscrew[ray]'")
    return on_ray


def on_ray(work: Callable[[Any], Done], todo: Sequence[Any], jobs: int) -> Iterator[tuple[int, Done]]:
    """Works on the parts on the Ray cluster that `RAY_ADDRESS` names, or on a local one of so many processes.

    Nothing is written on the cluster's machines: findings come back, and are written here.  Its machines need
    turnscrew installed.
    """
    import os

    import ray

    if not ray.is_initialized():
        local = {} if "RAY_ADDRESS" in os.environ else {"num_cpus": jobs, "include_dashboard": False}
        ray.init(log_to_driver=False, **local)
    remote = ray.remote(num_cpus=1)(work)
    under_way = {remote.remote(part): index for index, part in enumerate(todo)}
    try:
        while under_way:
            for ready in ray.wait(list(under_way), num_returns=1)[0]:
                yield under_way.pop(ready), ray.get(ready)
    finally:
        for left in under_way:
            ray.cancel(left, force=True)
