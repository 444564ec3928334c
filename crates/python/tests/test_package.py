"""The package itself."""

import os
import subprocess
import sys

import alhazen


def test_back_ends_are_listed():
    backends = {b["name"]: b for b in alhazen.backends()}
    assert backends["cpu"]["available"]
    assert sum(b["chosen"] for b in backends.values()) == 1
    assert set(backends["cpu"]) == {"name", "available", "chosen", "device", "reason"}


def test_everything_has_a_docstring_and_a_type():
    here = os.path.dirname(alhazen.__file__)
    assert os.path.isfile(os.path.join(here, "py.typed"))
    with open(os.path.join(here, "_alhazen.pyi"), encoding="utf-8") as file:
        stubs = file.read()
    for name in alhazen.__all__:
        thing = getattr(alhazen, name)
        assert thing.__doc__, f"{name} has no docstring"
        if not isinstance(thing, type) or thing.__module__ in ("alhazen._picture", "alhazen.mujoco"):
            continue
        for member, value in vars(thing).items():
            if not member.startswith("_"):
                assert getattr(value, "__doc__", None), f"{name}.{member} has no docstring"
                assert f"def {member}(" in stubs, f"{name}.{member} has no type"


def test_the_package_imports_quickly_with_numpy_alone():
    """Processor time, and the best of several tries, because other programs run, too."""
    script = (
        "import sys, time; before = set(sys.modules)\n"
        "start = time.process_time(); import alhazen; seconds = time.process_time() - start\n"
        "files = {m: getattr(sys.modules[m], '__file__', None) or '' for m in set(sys.modules) - before}\n"
        "print(seconds, *{m.split('.')[0] for m, file in files.items() if 'site-packages' in file})"
    )
    best, foreign = 9.0, set()
    for _ in range(5):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        seconds, *names = done.stdout.split()
        best, foreign = min(best, float(seconds)), foreign | set(names)
    assert best < 0.3, f"the import took {best:.3f} s"
    assert foreign == {"alhazen", "numpy"}
