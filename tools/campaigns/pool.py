"""Where runs are made: threads of this machine, each of which waits for a pmsim, or the workers of a Dask cluster. Both
are executors of Python's concurrent.futures; what runs when and where is theirs."""

import os
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

from . import worker

WORKERS_WITHIN_S = 60  # of a scheduler that has just been started
AHEAD = 3  # chunks per core that are handed over before the first of them comes back


def cores():
    """That this process may use."""
    return len(os.sched_getaffinity(0))


class Pool:
    """An executor with its number of cores. scheduler: address of a Dask scheduler; None: this machine."""

    def __init__(self, scheduler=None, jobs=None):
        self.client = None
        if scheduler is None:
            self.cores = jobs or cores()
            self.executor = ThreadPoolExecutor(self.cores)
            return
        import cloudpickle  # only where there is a cluster
        from distributed import Client

        cloudpickle.register_pickle_by_value(worker)  # scheduler and workers need not have this project
        try:
            self.client = Client(scheduler, timeout=10)
        except ValueError as error:
            raise OSError(f"{scheduler}: {error}") from None
        try:
            self.client.wait_for_workers(1, timeout=WORKERS_WITHIN_S)
        except TimeoutError as none:
            self.client.close()
            raise OSError(f"{scheduler}: has no worker after {WORKERS_WITHIN_S} s") from none
        self.cores = sum(self.client.nthreads().values())
        self.executor = self.client.get_executor(pure=False)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.client:
            self.executor.shutdown(wait=False)
            self.client.close()
            return
        if error[0] is not None:
            worker.stop()
        self.executor.shutdown(cancel_futures=True)

    def submit(self, function, *words):
        if self.client is None:
            return self.executor.submit(function, *words)
        return self.executor.submit(lambda *x: function(*x), *words)  # what has no name is sent whole

    def each(self, tasks):
        """Results of tasks (function, *arguments) as they are done: (task, result). Tasks are taken from their iterator
        when there is room, so that making them costs no memory."""
        running = {}
        tasks = iter(tasks)
        more = True
        try:
            while more or running:
                while more and len(running) < AHEAD * max(self.cores, 1):
                    task = next(tasks, None)
                    more = task is not None
                    if more:
                        running[self.submit(*task)] = task
                done, _ = wait(running, return_when=FIRST_COMPLETED) if running else ((), None)
                for future in done:
                    yield running.pop(future), future.result()
        finally:
            for future in running:
                future.cancel()
