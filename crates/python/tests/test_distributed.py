"""Pictures on several workers."""

import os
import pathlib
import re
import signal
import threading

import numpy as np
import pytest

import alhazen

distributed = pytest.importorskip("distributed")
import alhazen.distributed as cluster_render  # noqa: E402

LAYERS = ["depth", "normal", "material", "samples", "standard-error"]
PICTURE = dict(width=40, height=30, spp=10, aovs=LAYERS, seed=3, backend="cpu")


@pytest.fixture(scope="module")
def client():
    """Two workers of one thread each, in processes of their own."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        yield client


def assert_same(a, b):
    assert set(a) == set(b)
    for name in a:
        assert np.array_equal(a[name], b[name]), name


def test_two_workers_give_the_bits_of_one_process(client):
    whole = alhazen.load("cornell").render(**PICTURE)
    seen = []
    picture = cluster_render.render(
        "cornell", client=client, tiles=5, sample_ranges=3, progress=seen.append, **PICTURE
    )
    assert_same(picture, whole)
    assert (picture.spp, picture.backend) == (10, "cpu")
    assert seen == sorted(seen) and len(seen) == 15 and seen[-1] == 1.0
    # Another division, chosen by itself.
    assert_same(cluster_render.render("cornell", client=client, **PICTURE), whole)


def test_the_comparison_notices_another_seed(client):
    other = cluster_render.render("cornell", client=client, tiles=2, **{**PICTURE, "seed": 4})
    with pytest.raises(AssertionError):
        assert_same(other, alhazen.load("cornell").render(**PICTURE))


def test_a_worker_that_is_killed_costs_its_tasks_only(client):
    settings = {**PICTURE, "spp": 400}
    whole = alhazen.load("cornell").render(**settings)
    pids = client.run(os.getpid)
    assert len(pids) == 2
    victim = next(iter(pids.values()))
    seen = []

    def kill_one(share):
        seen.append(share)
        if len(seen) == 4:
            os.kill(victim, signal.SIGKILL)

    picture = cluster_render.render("cornell", client=client, tiles=4, sample_ranges=5, progress=kill_one, **settings)
    assert_same(picture, whole)
    client.wait_for_workers(2, timeout=60)
    assert victim not in client.run(os.getpid).values(), "the worker was not killed"


def test_parts_can_be_kept(client, tmp_path):
    part = cluster_render.render_part("cornell", client=client, tiles=2, **PICTURE)
    part.save(tmp_path / "sum.exr")
    assert_same(alhazen.Part.load(tmp_path / "sum.exr").picture(), alhazen.load("cornell").render(**PICTURE))


def test_the_documentation_s_example_runs(tmp_path, monkeypatch):
    page = pathlib.Path(__file__).resolve().parents[3] / "docs" / "cluster.md"
    (example,) = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, page.name, "exec"), {"__name__": "__main__"})
    assert (tmp_path / "cornell.png").read_bytes().startswith(b"\x89PNG")


def test_files_and_parameters_reach_the_workers(client, tmp_path):
    obj = tmp_path / "square.obj"
    settings = dict(width=16, height=16, spp=2, backend="cpu")
    for size in (1, 2):
        obj.write_text(f"v -{size} -1 0\nv {size} -1 0\nv {size} 1 0\nv -{size} 1 0\nf 1 2 3 4\n")
        os.utime(obj, (size, size))
        assert_same(
            cluster_render.render(obj, client=client, tiles=2, **settings), alhazen.load(obj).render(**settings)
        )
    parameters = {"columns": "1", "rows": "1"}
    assert_same(
        cluster_render.render("material-grid", client=client, tiles=2, parameters=parameters, **settings),
        alhazen.load("material-grid", parameters=parameters).render(**settings),
    )


def test_errors_come_back(client):
    with pytest.raises(alhazen.LoadError, match="missing.obj"):
        cluster_render.render("missing.obj", 8, 8, 1, client=client, retries=0)
    with pytest.raises(ValueError, match="cannot be cut into"):
        cluster_render.render("cornell", 2, 2, 1, client=client, tiles=99, retries=0)
    with pytest.raises(ValueError, match="sample_ranges"):
        cluster_render.render("cornell", 8, 8, client=client, sample_ranges=2)
    with pytest.raises(ValueError, match="sample_ranges"):
        cluster_render.render("cornell", 8, 8, 2, client=client, sample_ranges=3)


def test_an_interrupt_stops_the_workers(client):
    class Enough(Exception):
        pass

    def stop(share):
        raise Enough

    with pytest.raises(Enough):
        cluster_render.render("cornell", 64, 64, 64, client=client, tiles=16, progress=stop)
    # The workers are free for others.
    done = threading.Event()
    client.submit(int, 1).add_done_callback(lambda _: done.set())
    assert done.wait(30)
