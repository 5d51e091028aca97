#!/usr/bin/env python3
"""Compares two Python threads that each press a surface with one thread, on an idle machine with two cores.

Pressing releases the global lock, so two threads take less than 1.2 times the time of one. Usage: python
benches/threads.py, in an environment with the Python module.
"""

import threading
import time

import asperity

REPETITIONS = 5


def seconds(surface, count):
    """Returns the shortest time in which `count` threads press the surface at the same time, on a core each."""
    times = []
    for _ in range(REPETITIONS):
        press = {"target": asperity.press, "args": (surface,), "kwargs": {"loads": [0.02, 0.05, 0.1], "jobs": 1}}
        threads = [threading.Thread(**press) for _ in range(count)]
        begun = time.perf_counter()
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        times.append(time.perf_counter() - begun)
    return min(times)


for nodes in [512, 1024]:
    surface = asperity.surface(nodes=nodes, hurst=0.8, k_lower=4, k_upper=nodes // 4, seed=1)
    one, two = seconds(surface, 1), seconds(surface, 2)
    print(f"{nodes} × {nodes} nodes: one thread {one:.3f} s, two threads {two:.3f} s, ratio {two / one:.2f}")
