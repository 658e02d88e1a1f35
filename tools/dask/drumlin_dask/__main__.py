"""``python -m drumlin_dask PLAN [--scheduler ADDRESS | --workers N]``"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys

from distributed import Client, LocalCluster

from . import TaskError, build, read_plan


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="drumlin_dask", description="Builds what `drumlin plan` planned, on Dask.")
    parser.add_argument("plan", metavar="PLAN", help="what `drumlin plan` wrote")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--scheduler", metavar="ADDRESS", help="a scheduler that runs already, as tcp://host:8786")
    where.add_argument("--workers", metavar="N", type=int, default=os.cpu_count(), help="processes on this machine [all cores]")
    parser.add_argument("--memory", metavar="BYTES", type=int, help="memory for all processes on this machine together")
    parser.add_argument("--retries", metavar="N", type=int, default=3, help="how often a task is tried again [3]")
    parser.add_argument("--drumlin", metavar="PROGRAM", default="drumlin", help="the program, as workers find it")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    return parser.parse_args()


def cluster(asked: argparse.Namespace, task_bytes: int) -> LocalCluster:
    """Processes on this machine, which share what memory there may be."""
    resources = {}
    if asked.memory:
        resources["memory"] = asked.memory // asked.workers
        if task_bytes > resources["memory"]:
            raise ValueError(
                f"a task takes {task_bytes} bytes, and {asked.workers} workers have {resources['memory']} each; "
                "fewer workers, or a plan with a smaller --memory-budget"
            )
    return LocalCluster(n_workers=asked.workers, threads_per_worker=1, processes=True, resources=resources)


def bar(done: int, count: int) -> None:
    """A line that is drawn over itself on a terminal, and one a tenth of the way elsewhere."""
    width = 40 * done // count
    if sys.stderr.isatty():
        print(f"\r[{'#' * width:<40}] {done} of {count} tasks", end="\n" if done == count else "", file=sys.stderr, flush=True)
    elif 10 * done // count > 10 * (done - 1) // count:
        print(f"{done} of {count} tasks", file=sys.stderr, flush=True)


def main() -> int:
    asked = arguments()
    try:
        plan = read_plan(asked.plan)
        with contextlib.ExitStack() as stack:
            where = asked.scheduler or stack.enter_context(cluster(asked, plan.memory_bytes))
            client = stack.enter_context(Client(where))
            client.wait_for_workers(1)
            print(f"dashboard: {client.dashboard_link}", file=sys.stderr)
            progress = (lambda *_: None) if asked.quiet else bar
            build(client, plan, drumlin=asked.drumlin, retries=asked.retries, progress=progress)
    except (TaskError, ValueError, OSError) as error:
        print(f"drumlin_dask: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
