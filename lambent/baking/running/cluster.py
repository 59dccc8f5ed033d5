"""Jobs on other processes and machines, by Dask (`distributed`).

    with opened(8) as workers:                         # processes of this machine
        bake(scene, folder, workers=workers)
    with opened("tcp://10.0.0.1:8786") as workers:     # a cluster that runs already
        ...

Only this process reads and writes the store. Work and jobs travel as bytes within Dask's tasks, so that the scheduler
can reassign them if a worker dies.
"""

from __future__ import annotations

import asyncio
import pickle
import signal
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from importlib.metadata import version
from itertools import islice
from typing import Any, TypeVar

from lambent.baking.engine import engine, set_threads
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent

J = TypeVar("J")
R = TypeVar("R")
AHEAD = 2  # jobs per worker: one is sent while another runs
SECONDS = 30.0  # timeout for the first worker to appear
LIBRARIES = ("lambent", "mitsuba", "drjit", "numba", "numpy")
_one_at_a_time = threading.Lock()  # a job uses all threads of its process


@contextmanager
def opened(on: int | str, progress: Progress = silent) -> Iterator[DaskWorkers]:
    """That many new processes of this machine, or the workers of the cluster at an address, which outlive this context.

    New processes start Python afresh: a script needs `if __name__ == "__main__":`.

    Raises
    ------
    UserError
        If Dask is missing, nothing answers at the address, no worker appears, or versions differ.
    """
    try:
        import distributed
    except ImportError as error:
        raise UserError("Dask is not installed", field="--on", hint="pip install 'lambent[cluster]'") from error
    check_count(on)
    warnings.filterwarnings("ignore", "Sending large graph")  # sending tiles with their jobs is intended
    with ExitStack() as stack:
        threads, address = None, str(on)
        if isinstance(on, int):
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="lambent-"))
            threads = engine().threads // on
            with _deaf():
                local = distributed.LocalCluster(
                    n_workers=on, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0",
                    memory_limit=0, local_directory=folder,
                )  # fmt: skip
            address = stack.enter_context(local).scheduler_address
        progress(0, 1, f"connecting to {address}")
        try:
            asyncio.run(_connect(address))
            client = stack.enter_context(distributed.Client(address, timeout=SECONDS))
        except (OSError, TimeoutError, ValueError) as error:
            expected, hint = "a number of processes, or tcp://HOST:PORT", "start a scheduler with `dask scheduler`"
            raise UserError("no scheduler answered", field="--on", got=address, expected=expected, hint=hint) from error
        progress(0, 1, "waiting for a worker")
        try:
            client.wait_for_workers(1, timeout=SECONDS)
        except TimeoutError as error:
            hint = f"start some with `dask worker {address} --nthreads 1`"
            raise UserError("the scheduler has no workers", field="--on", got=address, hint=hint) from error
        _check_versions(client)
        # By default results pass through the scheduler, whose network would limit a large cluster.
        client.direct_to_workers = _reaches(client)
        yield DaskWorkers(client, threads)


def check_count(on: int | str) -> None:
    """Raise `UserError` for fewer than one process."""
    if isinstance(on, int) and on < 1:
        raise UserError("no workers", field="--on", got=on, expected="at least 1, or the address of a scheduler")


@contextmanager
def _deaf() -> Iterator[None]:
    """Shield processes started here from Ctrl-C, which is for their parent."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _check_versions(client: Any) -> None:
    """Raise `UserError` for other libraries there: a process that lacks Lambent ends at its first task."""
    found = client.get_versions(packages=[*LIBRARIES])
    there: list[tuple[str, Any, tuple[str, ...]]] = [("the scheduler", found["scheduler"], LIBRARIES[:1])]
    there += [("a worker", one, LIBRARIES) for one in found["workers"].values()]
    for who, one, names in there:
        for name in names:
            if (got := one["packages"].get(name)) != (mine := version(name)):
                hint = "install the same versions on every machine"
                what = f"{who} has a different {name}" if got else f"{who} lacks {name}"
                raise UserError(what, field="--on", got=got, expected=mine, hint=hint)


async def _connect(address: str) -> None:
    """Raise connection errors early. A `Client` that cannot connect may block the next one when garbage collected."""
    from distributed import Security
    from distributed.comm import connect

    comm = await connect(address, timeout=SECONDS, **Security().get_connection_args("client"))
    await comm.close()


def _reaches(client: Any) -> bool:
    """Whether this process can connect to a worker: some clusters show only their scheduler."""
    try:
        asyncio.run(_connect(next(iter(client.nthreads()))))
    except (OSError, StopIteration):
        return False
    return True


class DaskWorkers:
    """The workers of a Dask client; see `lambent.baking.running.workers.Workers`."""

    apart = True

    def __init__(self, client: Any, threads: int | None = None) -> None:
        self.client, self._threads = client, threads

    def each(self, work: Callable[[J], R], jobs: Iterable[J]) -> Iterator[tuple[J, R]]:
        """Yield jobs with their results, in order of completion.

        If a worker dies, its job goes to another worker, until three have died with it.

        Raises
        ------
        UserError
            If a worker has other versions of libraries that affect results, a job kills its workers, or the scheduler
            is gone.
        """
        from distributed import wait

        left, waiting = iter(jobs), dict[Any, J]()
        shared = self.client.submit(_same, pickle.dumps(work), pure=False)
        makers = made_with()
        try:
            while True:
                room = AHEAD * max(1, len(self.client.nthreads())) - len(waiting)
                for job in islice(left, max(0, room)):
                    waiting[self.client.submit(_do, shared, pickle.dumps(job), makers, self._threads, pure=False)] = job
                if not waiting:
                    return
                try:
                    done = wait(list(waiting), return_when="FIRST_COMPLETED").done
                except asyncio.CancelledError as error:
                    hint = "finished work is kept; run the same command to continue"
                    raise UserError("lost the connection to the scheduler", field="--on", hint=hint) from error
                for future in done:
                    yield waiting.pop(future), _result(future)
        finally:
            self.client.cancel([*waiting, shared])


def made_with() -> dict[str, str]:
    """Everything besides jobs that affects results: versions, and the engine's variant."""
    return {name: version(name) for name in LIBRARIES} | {"engine": engine().variant}


def _result(future: Any) -> Any:
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except UserError as error:
        if error.file is None:
            raise
        hint = "pictures of environments and measured tables need the same path on every machine"
        raise UserError(f"on a worker: {error.message}", file=error.file, hint=hint) from error
    except KilledWorker as error:
        hint = "see their logs; where memory is short, use fewer workers"
        raise UserError("several workers died while tracing the same tile", field="--on", hint=hint) from error


def _same(work: bytes) -> bytes:
    """The work as a task's result: unlike scattered data, Dask recreates it if its holder dies."""
    return work


def _do(work: bytes, job: bytes, makers: dict[str, str], threads: int | None) -> Any:
    """Run a job on a worker."""
    with _one_at_a_time:
        mine = made_with()
        for name, wanted in makers.items():
            if mine[name] != wanted:
                raise UserError(f"a worker has a different {name}", field="--on", got=mine[name], expected=wanted)
        if threads is not None:
            set_threads(threads)
        return _loaded(work)(pickle.loads(job))


@lru_cache(maxsize=1)
def _loaded(work: bytes) -> Any:
    return pickle.loads(work)
