"""A later process finds the kernels that an earlier one compiled."""

import subprocess
import sys

import pytest

from ngi.files.resources import root
from ngi.machine.backend import llvm_problem

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))

RENDERING = """
import sys
import torch
from ngi.machine.backend import dr
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes

held = [bytearray(int(size)) for size in sys.argv[1].split()]  # so that later memory lies elsewhere
renderer = MitsubaRenderer(
    scene=read_scene(**scenes()["living-room"]), backend="llvm", patch_size=32,
    samples_per_pixel=4, specular="traced", direct="with_caustics",
)
with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
    renderer.render_patches(torch.full((1, renderer.dimensions + 2), 0.5), resolution=32, seed=1)
    for kernel in dr.kernel_history([dr.KernelType.JIT]):
        print(kernel["hash"])
"""


def kernels(held: str) -> list[str]:
    """Hashes of what a process of its own launches for its first patch, in order."""
    command = [sys.executable, "-c", RENDERING, held]
    done = subprocess.run(command, cwd=root(), capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_of_a_scene_of_many_materials_with_caustics() -> None:
    """Dr.Jit keeps kernels by what is in them: the numbers of materials, which follow the order of
    loading, and how memory is aligned that it did not allocate.
    """
    first = kernels("")
    assert len(first) > 10
    for held in ("40", "40 72 24"):
        assert kernels(held) == first
