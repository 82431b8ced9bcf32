"""Everything there is to find out on a GPU, by one command that can be cut off and called again.

`ngi gpu-check` says what the machine has, trains every method on the GPU and on the processor and
compares them, compares LLVM's pixels with CUDA's on every scene, runs the benchmark, trains at the
paper's size, and counts frames. Each result is written down, with the card's name, before the next
is begun: one JSON file and one page. With `--minutes` it ends in time, and the next call goes on.
"""
