"""Which workers a user asked for."""

from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.cluster import DaskWorkers
from depthtrack.evaluation.sweep.local import LocalWorkers
from depthtrack.evaluation.sweep.run import Workers
from depthtrack.machine import usable_cores


def chosen_workers(jobs: int | None, scheduler: str | None = None) -> Workers:
    """A Dask cluster where its scheduler is named, else processes of this machine, one a core unless told.

    Raises InputError.
    """
    if scheduler is not None:
        return DaskWorkers(scheduler)
    jobs = usable_cores() if jobs is None else jobs
    if not 1 <= jobs <= 1024:
        raise InputError(f"--jobs must lie between 1 and 1024, found {jobs}")
    return LocalWorkers(jobs)
