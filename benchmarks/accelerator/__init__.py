"""The gain of a GPU in each stage, and its effect on results: `python -m benchmarks.accelerator`.

`__main__` starts every measurement as a process of its own, `render`, `perceive` and `learn`, in the environment of the
CPU or of the GPU: which driver draws and which device computes is settled when a process loads its libraries, and what
is missing here costs its own row alone.
"""
