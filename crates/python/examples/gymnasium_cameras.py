"""Camera observations of many worlds: a vector environment of Gymnasium whose pictures Alhazen makes in one call.

    pip install mujoco gymnasium
    python gymnasium_cameras.py --worlds 16 --steps 100

Each world is a pendulum on a cart that an agent pushes. All worlds are in one scene, so that one call of `render_views` sees
all of them; the simulations run by themselves.
"""

import argparse
import time
from typing import Any, Dict, Optional, Tuple

import gymnasium
import mujoco
import numpy as np

import alhazen

MODEL = """
<mujoco>
  <option timestep="0.01"/>
  <visual><headlight ambient="0.3 0.3 0.3" diffuse="0.3 0.3 0.3"/></visual>
  <worldbody>
    <light type="directional" dir="-0.3 0.5 -1" diffuse="0.6 0.6 0.6"/>
    <camera name="front" pos="0 -3 1" xyaxes="1 0 0 0 0.1 1" fovy="50"/>
    <geom type="plane" size="4 4 1" rgba="0.6 0.6 0.55 1"/>
    <body pos="0 0 0.4">
      <joint name="slide" type="slide" axis="1 0 0" range="-1 1" limited="true" damping="0.5"/>
      <geom type="box" size="0.2 0.1 0.08" mass="1" rgba="0.2 0.4 0.8 1"/>
      <body>
        <joint name="hinge" type="hinge" axis="0 1 0" damping="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.03" mass="0.1" rgba="0.9 0.6 0.2 1"/>
        <geom type="sphere" size="0.07" pos="0 0 0.6" mass="0.2" rgba="0.8 0.2 0.2 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slide" gear="10" ctrlrange="-1 1" ctrllimited="true"/></actuator>
</mujoco>
"""


class PendulumCameras(gymnasium.vector.VectorEnv):
    """Observations are "depth" of shape (worlds, size, size) and "rgb"; an action pushes a cart, from -1 to 1. An episode
    ends when its pendulum is below the cart, and begins anew with the next step."""

    def __init__(self, worlds: int, size: int = 64, spp: int = 1, backend: str = "auto") -> None:
        self.num_envs, self.size = worlds, size
        self.options = {"spp": spp, "integrator": "direct", "backend": backend}
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = [mujoco.MjData(self.model) for _ in range(worlds)]
        self.scene = alhazen.from_mujoco(self.model, worlds=worlds, spacing=30)
        space = gymnasium.spaces
        self.single_observation_space = space.Dict(
            depth=space.Box(0, np.inf, (size, size), np.float32),
            rgb=space.Box(0, np.inf, (size, size, 3), np.float32),
        )
        self.single_action_space = space.Box(-1, 1, (1,), np.float32)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, worlds)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, worlds)
        self.ended = np.zeros(worlds, bool)

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Dict[str, Any]] = None
    ) -> Tuple[Dict[str, Any], Dict[str, Any]]:
        super().reset(seed=seed)
        for world in range(self.num_envs):
            self._begin(world)
        return self._see(), {}

    def step(self, actions: Any) -> Tuple[Dict[str, Any], Any, Any, Any, Dict[str, Any]]:
        rewards = np.zeros(self.num_envs)
        for world, (data, action) in enumerate(zip(self.data, actions)):
            if self.ended[world]:
                self._begin(world)
                continue
            data.ctrl[:] = action
            mujoco.mj_step(self.model, data, nstep=2)
            mujoco.mj_forward(self.model, data)
            rewards[world] = np.cos(data.joint("hinge").qpos[0])
        self.ended = np.array([abs(d.joint("hinge").qpos[0]) > 0.5 * np.pi for d in self.data])
        return self._see(), rewards, self.ended.copy(), np.zeros(self.num_envs, bool), {}

    def _begin(self, world: int) -> None:
        data = self.data[world]
        mujoco.mj_resetData(self.model, data)
        data.qpos[:] = self.np_random.uniform(-0.2, 0.2, self.model.nq)
        mujoco.mj_forward(self.model, data)

    def _see(self) -> Dict[str, Any]:
        self.scene.update(self.data)
        return self.scene.render_views(self.size, self.size, layers=["depth", "rgb"], **self.options)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=16)
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--backend", default="auto")
    arguments = parser.parse_args()
    env = PendulumCameras(arguments.worlds, arguments.size, backend=arguments.backend)
    env.action_space.seed(1)
    env.reset(seed=1)
    start = time.perf_counter()
    for _ in range(arguments.steps):
        seen, rewards, *_ = env.step(env.action_space.sample())
    rate = arguments.worlds * arguments.steps / (time.perf_counter() - start)
    print(f"{rate:.0f} observations a second; mean depth {seen['depth'].mean():.2f} m, reward {rewards.mean():.2f}")


if __name__ == "__main__":
    main()
