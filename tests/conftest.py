import gc

from tests import quick_files, quick_hydra, quick_kernels

quick_files.use()
quick_hydra.use()
quick_kernels.use()


def pytest_collection_finish() -> None:
    """What the tests' imports made is not looked at again by every garbage collection.

    It is half a million objects, and each renderer that is made collects twice: a third of the
    time of the tests that render.
    """
    gc.collect()
    gc.freeze()
