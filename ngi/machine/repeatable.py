"""A run repeats bit for bit on a GPU, too."""

import os

CUBLAS_WORKSPACE = ":4096:8"
"""Without a workspace of a fixed size products may be summed up in another order each time."""


def make_repeatable() -> None:
    """Has PyTorch take those of CUDA's algorithms that repeat; does nothing without a GPU.

    The operators of the shipped networks have all such algorithms (`ngi.methods.anf.unet` goes
    round the one that has not). Another one's network may use some that have none: PyTorch warns
    then. Call it before anything is computed on the GPU.
    """
    import torch

    if not torch.cuda.is_available():
        return
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", CUBLAS_WORKSPACE)
    torch.use_deterministic_algorithms(True, warn_only=True)
    # Filling what is about to be written anyway would cost a pass over memory each time.
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]
