"""Rendering again and again leaves nothing behind. ALHAZEN_SOAK_SECONDS=N: for so long."""

import gc
import os
import sys
import time

import numpy as np
import pytest

import alhazen

SECONDS = float(os.environ.get("ALHAZEN_SOAK_SECONDS", "5"))


def held():
    """Bytes and open files of this process."""
    gc.collect()
    with open("/proc/self/statm") as file:
        pages = int(file.read().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE"), len(os.listdir("/proc/self/fd"))


def a_round(number):
    """A scene is made, edited, rendered, saved, loaded, asked for rays, and an error is raised."""
    scene = alhazen.load("cornell" if number % 2 else "three-spheres")
    scene.set_material(0, base_color=[0.2, 0.4, (number % 10) / 10], roughness=0.5)
    picture = scene.render(32, 24, spp=2, backend="cpu", threads=1, aovs=["depth", "normal"])
    assert np.isfinite(picture["color"]).all()
    with pytest.raises(ValueError):
        scene.set_material(0, roughness=float("nan"))
    with pytest.raises(alhazen.LoadError):
        alhazen.load("missing.obj")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells what a process holds")
def test_hours_of_rendering_leave_nothing_behind():
    begin, number, settled = time.monotonic(), 0, None
    while time.monotonic() - begin < SECONDS or number < 6:
        a_round(number)
        number += 1
        if settled is None and time.monotonic() - begin > SECONDS / 3:
            settled = held()
    now = held()
    print(f"{number} rounds, {settled} to {now}")
    assert now[0] < settled[0] * 1.08
    assert now[1] <= settled[1] + 1
