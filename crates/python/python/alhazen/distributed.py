"""Pictures on many machines, through `Dask distributed <https://distributed.dask.org>`_.

Tiles and ranges of samples are tasks; their parts are added up in a tree on the workers. A worker that dies costs its tasks,
which Dask gives to others. The picture has the bits of one that a single process renders::

    import alhazen.distributed
    from distributed import Client

    with Client("scheduler:8786") as client:
        picture = alhazen.distributed.render("/shared/model.glb", 1920, 1080, spp=1024, client=client)

Every worker needs this package in the same version, and the scene under the same path.
"""

import math
import os
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Optional, Tuple, Union

from ._alhazen import Part, Scene, load, merge
from ._picture import Picture

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["render", "render_part"]

#: Parts that one task adds up: more means fewer transfers, and more memory for each.
_FAN_IN = 4

#: Samples that a thread makes in a second, and seconds that a task costs beside its work: what is typical will do, as the
#: number of tiles goes with the square root.
_SAMPLES_A_SECOND = 2e6
_HANDING_OUT = 0.015

#: The last scene that this worker has loaded, and what it was loaded from.
_loaded: Optional[Tuple[object, Scene]] = None


def render(
    scene: "str | os.PathLike[str]",
    width: Optional[int] = None,
    height: Optional[int] = None,
    spp: Optional[int] = None,
    *,
    client: "Client",
    **options: Any,
) -> Picture:
    """Renders a picture on the workers of a Dask cluster.

    Parameters
    ----------
    scene : str or os.PathLike
        A file that all workers see under this path, or the name of a built-in scene.
    width, height, spp : int, optional
        As for `Scene.render`.
    client : distributed.Client
        Where to render.
    **options
        See `render_part`.

    Returns
    -------
    Picture
        Colour and layers as float32 arrays of shape (height, width, channels), the same bits as of `Scene.render`.
    """
    return render_part(scene, width, height, spp, client=client, **options).picture()


def render_part(
    scene: "str | os.PathLike[str]",
    width: Optional[int] = None,
    height: Optional[int] = None,
    spp: Optional[int] = None,
    *,
    client: "Client",
    tiles: Optional[int] = None,
    sample_ranges: int = 1,
    parameters: Optional[Dict[str, str]] = None,
    retries: int = 2,
    progress: Optional[Callable[[float], object]] = None,
    **settings: Any,
) -> Part:
    """As `render`, but the exact sums, for saving them or adding up more.

    Parameters
    ----------
    scene, width, height, spp, client
        As for `render`.
    tiles : int, optional
        Tiles of the picture. Without it, as many as keep both small: the time that threads wait for the last one, and the
        time that handing them out takes. That is between 8 and 64 for each thread of the cluster.
    sample_ranges : int, default 1
        Ranges of samples of each tile; needs `spp`.
    parameters : dict of str, optional
        Parameters of scene files and built-in scenes.
    retries : int, default 2
        How often a task is tried again that fails. Tasks of workers that die are given to others in any case.
    progress : callable, optional
        Called with the share of the tasks that are done, from 0 to 1.
    **settings
        What else `Scene.render_part` takes, such as `camera` (by name or number), `aovs`, `seed` and `backend`. Each
        worker renders with as many `threads` as Dask has given it, unless told otherwise.

    Returns
    -------
    Part
    """
    from distributed import as_completed

    if sample_ranges > 1 and spp is None:
        raise ValueError("sample_ranges: name the number of samples to divide with spp")
    if sample_ranges < 1 or (spp is not None and sample_ranges > spp):
        raise ValueError(f"sample_ranges: {spp} samples cannot be divided into {sample_ranges} ranges")
    if tiles is None:
        tiles = _tiles(width, height, spp, max(1, sum(client.nthreads().values())))
    shares = [
        {"tile": f"{tile + 1}/{tiles}", "samples": samples}
        for samples in _ranges(spp, sample_ranges)
        for tile in range(tiles)
    ]
    picture = {**settings, "width": width, "height": height, "spp": spp}
    source = (os.fspath(scene), parameters, _stamp(scene))
    # Not pure: what is at the path may have changed since Dask has seen the same call.
    tasks = [
        client.submit(_render_share, source, {**picture, **share}, pure=False, retries=retries) for share in shares
    ]
    everything = list(tasks)
    try:
        sums = tasks
        while len(sums) > 1:
            groups = [sums[i : i + _FAN_IN] for i in range(0, len(sums), _FAN_IN)]
            # Before further tiles are begun, so that their parts need not be kept.
            sums = [client.submit(merge, group, pure=False, priority=1, retries=retries) for group in groups]
            everything += sums
        done = as_completed(tasks)
        del tasks
        for number, finished in enumerate(done, 1):
            if finished.status == "error":
                finished.result()  # raises what the task raised
            if progress is not None:
                progress(number / len(shares))
        return sums[0].result()
    finally:
        # After an error or Ctrl-C nothing goes on; after success there is nothing left to stop.
        client.cancel(everything)


def _tiles(width: Optional[int], height: Optional[int], spp: Optional[int], threads: int) -> int:
    """How many tiles to make of a picture.

    At the end, threads wait half a tile on average, and every tile costs a moment to hand out. For `seconds` of work a thread
    the sum of both, ``seconds / (2 n) + n * _HANDING_OUT``, is least for the `n` below.
    """
    # What is not said is in the scene; most pictures are at least of this size.
    samples = (width or 512) * (height or width or 512) * (spp or 64)
    seconds = samples / (_SAMPLES_A_SECOND * threads)
    best = math.sqrt(seconds / (2 * _HANDING_OUT))
    return threads * round(min(max(best, 8), 64))


def _ranges(spp: Optional[int], count: int) -> "List[Optional[Tuple[int, int]]]":
    """Samples 0 to `spp` in `count` ranges that are as equal as can be; all of them is None."""
    if count == 1 or spp is None:
        return [None]
    return [(spp * i // count, spp * (i + 1) // count) for i in range(count)]


def _stamp(scene: "str | os.PathLike[str]") -> Union[float, None]:
    """When the file was changed last; None if it is a built-in scene, or not on this machine."""
    try:
        return os.stat(scene).st_mtime
    except OSError:
        return None


def _render_share(source: Tuple[str, Optional[Dict[str, str]], Union[float, None]], settings: Dict[str, Any]) -> Part:
    """Renders a part; runs on a worker."""
    from distributed import get_worker

    global _loaded
    # Tasks of one picture come one after the other: the scene is loaded once a worker.
    if _loaded is None or _loaded[0] != source:
        path, parameters, _ = source
        _loaded = (source, load(path, parameters=parameters))
    if settings.get("threads") is None:
        settings = {**settings, "threads": get_worker().state.nthreads}
    return _loaded[1].render_part(**settings)
