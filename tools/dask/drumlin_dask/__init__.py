"""Does the tasks of a Drumlin plan on Dask.

``drumlin plan`` writes a build down as tasks, ``drumlin task`` does one of them in whatever process it is called, and
may be called again or twice at once. So all that is left to do here is to hand them out: a Dask task for each, named
after its pass, and one that waits for all of a pass, since the next pass needs every task of it.
"""

from __future__ import annotations

import json
import pathlib
import subprocess
import uuid
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from distributed import Client, Future, as_completed

__all__ = ["Plan", "Task", "TaskError", "build", "read_plan", "submit"]


class TaskError(RuntimeError):
    """What ``drumlin`` said when a task failed."""


class Task(NamedTuple):
    """A line of a plan."""

    number: int
    pass_name: str
    memory_bytes: int
    weight: int


class Plan(NamedTuple):
    """A plan: its file, and its tasks pass by pass, each pass needing all of the one before."""

    file: pathlib.Path
    passes: list[list[Task]]

    @property
    def count(self) -> int:
        """How many tasks there are."""
        return sum(map(len, self.passes))

    @property
    def memory_bytes(self) -> int:
        """The most memory that one of them takes."""
        return max((task.memory_bytes for tasks in self.passes for task in tasks), default=0)


def read_plan(file: str | pathlib.Path) -> Plan:
    """Reads what ``drumlin plan`` wrote.

    Raises ``ValueError`` where it is something else, or needs more than this program knows of.
    """
    path = pathlib.Path(file).resolve()
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    if not lines or lines[0].get("drumlin_plan") != 1:
        raise ValueError(f"{path}: is not a plan of a version known here")
    passes: list[list[Task]] = []
    for line in lines[1:]:
        task = Task(line["task"], line["pass"], line["memory_bytes"], line["weight"])
        if not passes or passes[-1][0].pass_name != task.pass_name:
            before = passes[-1][0].pass_name if passes else None
            if line["needs"] != before:
                raise ValueError(f"{path}: task {task.number} needs {line['needs']}, which is not the pass before it")
            passes.append([])
        passes[-1].append(task)
    return Plan(path, passes)


def run(words: list[str]) -> None:
    """Runs ``drumlin`` where Dask has put it, and says what went wrong in its words."""
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = done.stderr.strip() or f"ended with {done.returncode}"
        raise TaskError(f"{' '.join(words)}: {said}")


def _task(words: list[str], _after: Any) -> None:
    run(words)


def _all_of(*_tasks: None) -> None:
    return None


def submit(client: Client, plan: Plan, *, drumlin: str = "drumlin", retries: int = 3) -> Iterator[Future]:
    """Gives all tasks of a plan to Dask, in order.

    Workers that have a resource ``memory`` (in bytes) are given no more tasks at once than fit it.
    """
    limited = all("memory" in worker.get("resources", {}) for worker in client.scheduler_info()["workers"].values())
    run_name = uuid.uuid4().hex[:8]  # Other plans may be at work on the same scheduler.
    after: Future | None = None
    for tasks in plan.passes:
        futures = []
        for task in sorted(tasks, key=lambda task: -task.weight):
            words = [drumlin, "task", str(plan.file), "--id", str(task.number)]
            future = client.submit(
                _task,
                words,
                after,
                key=f"{task.pass_name}-{run_name}-{task.number}",
                retries=retries,
                resources={"memory": task.memory_bytes} if limited else None,
                pure=False,
            )
            futures.append(future)
            yield future
        after = client.submit(_all_of, *futures, key=f"{tasks[0].pass_name}-{run_name}-done", pure=False)


def build(
    client: Client,
    plan: Plan,
    *,
    drumlin: str = "drumlin",
    retries: int = 3,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> None:
    """Does all tasks of a plan and publishes the pyramid.

    ``progress`` is told how many tasks are done, of how many. Raises ``TaskError`` with the words of the first task that
    failed for good; what is done then is kept by the next run.
    """
    futures = list(submit(client, plan, drumlin=drumlin, retries=retries))
    try:
        for done, future in enumerate(as_completed(futures), start=1):
            future.result()
            progress(done, plan.count)
    except BaseException:
        client.cancel(futures)
        raise
    run([drumlin, "finish", str(plan.file)])
