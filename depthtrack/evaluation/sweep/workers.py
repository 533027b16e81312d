"""Choose the workers of a sweep."""

from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.cluster import DaskWorkers
from depthtrack.evaluation.sweep.local import LocalWorkers
from depthtrack.evaluation.sweep.run import Workers
from depthtrack.machine import usable_cores


def chosen_workers(jobs: int | None, scheduler: str | None = None) -> Workers:
    """Return the workers of a Dask scheduler, or processes of this machine.

    jobs: number of processes; one per core if None.
    scheduler: address of a Dask scheduler; None for this machine.

    Raises:
        InputError: if the number of processes is out of range.
        MissingExtraError: if Dask is needed but not installed.
    """
    if scheduler is not None:
        return DaskWorkers(scheduler)
    jobs = usable_cores() if jobs is None else jobs
    if not 1 <= jobs <= 1024:
        raise InputError(f"--jobs must be from 1 to 1024, found {jobs}")
    return LocalWorkers(jobs)
