"""Takes all measurements of a GPU with one command, which can be interrupted and called again.

`ngi gpu-check` reports what the machine has, trains every method on the GPU and on the CPU and
compares them, compares LLVM's pixels with CUDA's on every scene, runs the benchmark, trains at the
paper's size, and measures frame rates. It saves each result, with the card's name, before it begins
the next, in one JSON file and one page. With `--minutes` it stops in time; the next call resumes.
"""
