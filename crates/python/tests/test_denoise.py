"""Pictures without their noise."""

import numpy as np
import pytest

import alhazen

LAYERS = ["albedo", "normal", "standard-error"]


def error(picture, reference):
    return np.mean((picture - reference) ** 2 / (reference**2 + 0.01))


def test_noise_goes_and_light_stays():
    scene = alhazen.load("cornell")
    reference = scene.render(96, 96, spp=512, seed=9, backend="cpu")["color"]
    noisy = scene.render(96, 96, spp=4, aovs=LAYERS, backend="cpu")
    clean = noisy.denoised()
    assert error(clean["color"], reference) < error(noisy["color"], reference) / 4
    assert np.allclose(clean["color"].mean((0, 1)), noisy["color"].mean((0, 1)), rtol=1e-3)
    assert np.array_equal(clean["noisy"], noisy["color"]) and clean.spp == 4
    assert "noisy" not in noisy
    # The same by arrays, and without what is not known.
    arrays = {"albedo": noisy["albedo"], "normal": noisy["normal"], "error": noisy["standard-error"]}
    assert np.array_equal(alhazen.denoise(noisy["color"], **arrays), clean["color"])
    alone = alhazen.denoise(noisy["color"])
    assert error(alone, reference) < error(noisy["color"], reference)


def test_bad_arrays_are_named():
    color = np.zeros((4, 5, 3), np.float32)
    with pytest.raises(ValueError, match="albedo: expected the shape"):
        alhazen.denoise(color, albedo=np.zeros((4, 5)))
    with pytest.raises(ValueError, match="normal has 4×4"):
        alhazen.denoise(color, normal=np.zeros((4, 4, 3)))
    color[0, 0] = [np.nan, np.inf, 1]
    assert np.isfinite(alhazen.denoise(color)).all()
