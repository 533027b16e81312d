"""Baselines: scorers with other renderers and ray casters, on a mesh of the same hand.

Each renders one hypothesis at a time, as its interface requires, and passes the depth map to the same objective.
"""

import os
from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.benchmarks.speed.tessellation import Tessellation
from depthtrack.errors import DepthtrackError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Terms, evaluate
from depthtrack.rendering.options import Objective
from depthtrack.rendering.scorer import ScorerBase, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Array32, Depth

INSTALL = {
    "pyrender": "pip install pyrender && pip install --upgrade PyOpenGL",  # it pins a PyOpenGL too old for numpy 2
    "open3d": "pip install open3d",
    "embree": "pip install 'depthtrack[embree]'",
}
"""Command that installs each library."""


class BaselineMissingError(DepthtrackError):
    """The library of a baseline is missing or does not load; the message gives the reason."""


class Baseline(ScorerBase):
    """Scorer that renders a mesh of the 37 primitives with another library.

    Raises:
        BaselineMissingError: if the library is not installed or does not load.
    """

    name: str

    def __init__(self, shape: HandShape, objective: Objective | None = None) -> None:
        self._model, self._objective = HandModel(shape), objective or Objective()
        self._mesh = Tessellation.of(Primitives.of(shape))
        try:
            self._load()
        except ModuleNotFoundError as error:
            raise BaselineMissingError(f"not installed: run  {INSTALL[self.name]}") from error
        except (ImportError, AttributeError, OSError) as error:
            raise BaselineMissingError(f"installed, but does not load: {error}") from error

    def set_target(self, target: Target) -> None:
        self._target = target
        self._prepare(target.camera)

    def score(self, poses: ArrayLike) -> Array:
        return self.terms(poses).energy

    def terms(self, poses: ArrayLike) -> Terms:
        batch, target = as_batch(poses), self.target
        sums = [
            evaluate(self._objective, target.silhouette, target.depth, self._depth(transforms))
            for transforms in self._model.transforms(batch)
        ]
        clamped, matched_silhouette, union = np.array(sums, dtype=np.float64).reshape(-1, 3).T
        return Terms.of_sums(self._objective, batch, clamped, matched_silhouette, union)

    def render(self, pose: ArrayLike) -> Depth:
        batch = as_batch(np.asarray(pose)[None])
        return self._depth(self._model.transforms(batch[0])).astype(np.float32, copy=False)

    @abstractmethod
    def _load(self) -> None:
        """Import the library and create the objects that do not depend on the observation."""

    @abstractmethod
    def _prepare(self, camera: Camera) -> None:
        """Create the objects that depend on the camera."""

    @abstractmethod
    def _depth(self, transforms: Array) -> NDArray[np.floating]:
        """Return the depth (h, w) of a hypothesis, m; 0 for none.

        transforms: (16, 4, 4) T_camera_body.
        """


class PyrenderScorer(Baseline):
    """Depth pass of pyrender on EGL, with one rigid mesh per body."""

    name = "pyrender"

    def _load(self) -> None:
        # The first import of OpenGL reads this, so each baseline runs in its own process.
        os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
        import pyrender
        from trimesh import Trimesh

        self._pyrender: Any = pyrender
        self._scene: Any = pyrender.Scene()
        self._nodes = []
        for body in range(int(self._mesh.bodies.max()) + 1):
            faces = self._mesh.faces[self._mesh.bodies[self._mesh.faces[:, 0]] == body]
            mesh = Trimesh(self._mesh.vertices, faces, process=False)
            mesh.remove_unreferenced_vertices()
            self._nodes.append(self._scene.add(pyrender.Mesh.from_trimesh(mesh)))
        self._eye: Any = None
        self._renderer: Any = None

    def _prepare(self, camera: Camera) -> None:
        if self._eye is not None:
            self._scene.remove_node(self._eye)
        # The camera of OpenGL views along -z with y up, and has pixel corners at whole numbers.
        intrinsics = self._pyrender.IntrinsicsCamera(camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5, 0.01, 10.0)
        self._eye = self._scene.add(intrinsics, pose=np.diag([1.0, -1.0, -1.0, 1.0]))
        if self._renderer is None:
            self._renderer = self._pyrender.OffscreenRenderer(camera.width, camera.height)
        self._renderer.viewport_width, self._renderer.viewport_height = camera.width, camera.height

    def _depth(self, transforms: Array) -> NDArray[np.floating]:
        for node, T in zip(self._nodes, transforms, strict=True):
            self._scene.set_pose(node, T)
        depth: Depth = self._renderer.render(self._scene, self._pyrender.RenderFlags.DEPTH_ONLY)
        return depth

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.delete()


class RayCaster(Baseline):
    """Scorer that casts a ray (dx, dy, 1) through each pixel, so that the distance is the depth."""

    def _prepare(self, camera: Camera) -> None:
        v, u = np.mgrid[: camera.height, : camera.width]
        self._rays = camera.unproject(np.stack([u, v], axis=-1), np.ones(camera.shape)).astype(np.float32)
        self._flat = np.ascontiguousarray(self._rays.reshape(-1, 3))


class Open3DScorer(RayCaster):
    """RaycastingScene of Open3D, made for each hypothesis because its geometry is fixed."""

    name = "open3d"

    def _load(self) -> None:
        import open3d

        self._core: Any = open3d.core
        self._new_scene: Any = open3d.t.geometry.RaycastingScene
        self._faces: Any = self._core.Tensor(self._mesh.faces.astype(np.uint32))

    def _prepare(self, camera: Camera) -> None:
        super()._prepare(camera)
        self._tensor: Any = self._core.Tensor(np.concatenate([np.zeros_like(self._rays), self._rays], axis=-1))

    def _depth(self, transforms: Array) -> NDArray[np.floating]:
        scene = self._new_scene()
        scene.add_triangles(self._core.Tensor(self._mesh.posed(transforms).astype(np.float32)), self._faces)
        distance: Array32 = scene.cast_rays(self._tensor)["t_hit"].numpy()
        return np.where(np.isfinite(distance), distance, 0)


class EmbreeScorer(RayCaster):
    """Embree through the binding `embreex`; the calls of trimesh would take twice as long."""

    name = "embree"

    def _load(self) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._new_scene: Any = EmbreeScene
        self._add_triangles: Any = TriangleMesh
        self._faces = self._mesh.faces.astype(np.int32)

    def _depth(self, transforms: Array) -> NDArray[np.floating]:
        scene = self._new_scene()
        self._add_triangles(scene, self._mesh.posed(transforms).astype(np.float32), self._faces)
        distance: Array32 = scene.run(np.zeros_like(self._flat), self._flat, query="DISTANCE")
        return np.where(distance < 1e30, distance, 0).reshape(self._rays.shape[:2])


BASELINES: dict[str, type[Baseline]] = {rival.name: rival for rival in (PyrenderScorer, Open3DScorer, EmbreeScorer)}
