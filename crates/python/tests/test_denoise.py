"""Pictures without their noise."""

import numpy as np
import pytest

import alhazen

LAYERS = ["albedo", "denoising-normal", "standard-error"]


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
    arrays = {"albedo": noisy["albedo"], "normal": noisy["denoising-normal"], "error": noisy["standard-error"]}
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


def test_sequences_are_cleaner_with_their_history():
    scene = alhazen.load("cornell")
    denoiser, last, together = alhazen.SequenceDenoiser(), None, None
    for frame in range(5):
        camera = alhazen.Camera.look_at([2.6 + 0.05 * frame, 2.73, -8], [2.78, 2.73, 0], fov_y=0.686)
        noisy = scene.render(96, 96, 4, camera=camera, seed=frame, aovs=[*LAYERS, "depth", "instance"], backend="cpu")
        layers = {"albedo": noisy["albedo"], "normal": noisy["denoising-normal"], "error": noisy["standard-error"]}
        flow = scene.observe(camera, 96, 96, next_camera=last or camera)["flow"]
        known = {"motion": flow, "distance": noisy["depth"], "ids": noisy["instance"].astype(np.uint32)}
        together = denoiser.denoise(noisy["color"], **layers, **known)
        if last is None:
            assert np.array_equal(together, alhazen.denoise(noisy["color"], **layers))
        last = camera
    reference = scene.render(96, 96, 512, camera=last, seed=99, backend="cpu")["color"]
    alone = alhazen.denoise(noisy["color"], **layers)
    assert error(together, reference) < error(alone, reference)
    assert np.allclose(together.mean((0, 1)), noisy["color"].mean((0, 1)), rtol=1e-3)


def test_what_does_not_fit_a_frame_is_named():
    denoiser, color = alhazen.SequenceDenoiser(), np.zeros((4, 5, 3), np.float32)
    for name, shape in [("motion", (4, 5)), ("motion", (5, 4, 2)), ("distance", (4, 4)), ("ids", (4, 5, 1))]:
        with pytest.raises(ValueError, match=f"{name} has the shape"):
            denoiser.denoise(color, **{name: np.zeros(shape)})
    motion = np.full((4, 5, 3), np.nan, np.float32)
    assert (denoiser.denoise(color, motion=motion, distance=np.zeros((4, 5))) == 0).all()
