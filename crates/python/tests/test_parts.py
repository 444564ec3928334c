"""Pictures made in parts."""

import pickle
import random

import numpy as np
import pytest

import alhazen

SETTINGS = dict(aovs=["normal", "instance"], seed=5, backend="cpu")


@pytest.fixture(scope="module")
def scene():
    return alhazen.load("cornell")


def parts(scene, spp=6):
    made = [
        scene.render_part(24, 20, spp, tile=f"{tile}/3", samples=samples, **SETTINGS)
        for tile in (1, 2, 3)
        for samples in ((0, 2), (2, spp))
    ]
    random.Random(1).shuffle(made)
    return made


def test_parts_add_up_to_the_same_bits(scene, tmp_path):
    whole = scene.render(24, 20, 6, **SETTINGS)
    made = parts(scene)
    assert not made[0].is_complete
    # By memory, by a message, by a file: all the same.
    made[0] = pickle.loads(pickle.dumps(made[0]))
    made[1].save(tmp_path / "part.exr")
    made[1] = alhazen.Part.load(tmp_path / "part.exr")
    merged = alhazen.merge([alhazen.merge(made[:2]), alhazen.merge(made[2:])])
    assert merged.is_complete and "complete" in repr(merged)
    picture = merged.picture()
    assert picture.spp == 6 and set(picture) == set(whole)
    for name in whole:
        np.testing.assert_array_equal(picture[name], whole[name])


def test_what_is_missing_and_what_does_not_belong_is_refused(scene):
    made = parts(scene)
    with pytest.raises(alhazen.PartError, match="not complete"):
        alhazen.merge(made[1:]).picture()
    assert alhazen.merge(made[1:]).picture(allow_missing=True)["color"].shape == (20, 24, 3)
    other = scene.render_part(24, 20, 6, tile="1/3", **{**SETTINGS, "seed": 6})
    with pytest.raises(alhazen.PartError, match="seed"):
        alhazen.merge([*made[1:], other])
    with pytest.raises(alhazen.PartError):
        alhazen.merge([*made, made[0]])
    with pytest.raises(alhazen.PartError):
        alhazen.Part.from_bytes(made[0].to_bytes()[:-100])
    with pytest.raises(ValueError, match="number 0 is no Part"):
        alhazen.merge([3])
    for bad, text in (({"tile": "5/4"}, "5/4"), ({"samples": (4, 9)}, "4..9"), ({"samples": (3, 3)}, "3..3")):
        with pytest.raises(ValueError, match=text):
            scene.render_part(24, 20, 6, backend="cpu", **bad)
    with pytest.raises(TypeError, match="sed"):
        scene.render_part(24, 20, 6, sed=3)
