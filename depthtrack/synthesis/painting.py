"""Colour frames: skin that varies from person to person and over the hand, light, and the colour camera's noise."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.backdrop import FACE, FOREARM, Backdrop
from depthtrack.synthesis.colour import linear_from_lab, srgb_from_linear
from depthtrack.synthesis.randomness import coarse_normal_noise
from depthtrack.synthesis.scene import View
from depthtrack.types import Array, Image, Mask


@dataclass(frozen=True)
class SkinTone:
    """Colours of one person's skin, linear RGB (3,): the hand's back and the paler palm.

    Lightness L* follows the individual typology angle ITA = atan((L* - 50) / b*), which runs from about 55 degrees in
    light to -35 in dark skin (Chardon, Cretois and Hourseau, "Skin colour typology and suntanning pathways", 1991; Del
    Bino and Bernerd, "Variations in skin colour and the biological consequences of ultraviolet radiation exposure",
    2013); a* = 9.6 and b* = 17.1 on average (Han, Choi and Son, "Skin color of Koreans", 2006). The palm has less
    pigment, whatever the rest (Yamaguchi et al., "Mesenchymal-epithelial interactions in the skin", 2004).
    """

    back: Array
    palm: Array

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Self:
        """Anybody's."""
        angle = np.radians(rng.uniform(-30, 50))
        a, b = rng.normal(9.6, 1.0), rng.normal(17.1, 1.2)
        lightness = 50 + b * np.tan(angle)
        paler = lightness + 0.5 * max(66 - lightness, 0)
        return cls(linear_from_lab(np.array([lightness, a, b])), linear_from_lab(np.array([paler, a + 3, b - 1])))


@dataclass(frozen=True)
class Light:
    """A lamp behind the camera and light from all around; `towards` (3,) unit, from the scene to the lamp."""

    towards: Array
    ambient: float
    lamp: float
    shine: float = 0.03

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Self:
        towards = np.array([rng.uniform(-0.5, 0.5), rng.uniform(-0.8, -0.2), -1.0])
        ambient = rng.uniform(0.35, 0.5)
        return cls(towards / np.linalg.norm(towards), ambient, 1.05 - ambient)

    def on(self, albedo: Array, normal: Array, shine: bool = False) -> Array:
        """Light (..., 3), linear RGB, that surfaces of `albedo` (..., 3) and `normal` (..., 3) send to the camera."""
        facing = np.maximum(normal @ self.towards, 0)
        light = albedo * (self.ambient + self.lamp * facing)[..., None]
        if shine:
            halfway = self.towards - np.array([0, 0, 1])
            light = light + self.shine * (np.maximum(normal @ (halfway / np.linalg.norm(halfway)), 0) ** 20)[..., None]
        return np.asarray(light)


class Painter:
    """Paints the views of one recording. The backdrop is painted once."""

    def __init__(
        self,
        shape: HandShape,
        camera: Camera,
        backdrop: Backdrop,
        tone: SkinTone,
        noise: float,
        rng: np.random.Generator,
    ) -> None:
        self._camera = camera
        self._tone = tone
        self._noise = noise
        self._light = Light.sample(rng)
        self._waves = rng.normal(0, 2 * np.pi / 0.03, (6, 3)).astype(np.float32)
        self._phases = rng.uniform(0, 2 * np.pi, 6).astype(np.float32)
        self._T_rest_body = _at_rest(shape)
        still = backdrop.surface
        light = self._light.on(backdrop.albedo(rng), still.normal) * (still.depth > 0)[..., None]
        self._background = np.rint(255 * srgb_from_linear(light)).astype(np.uint8)

    def paint(self, view: View, rng: np.random.Generator) -> Image:
        """RGB (h, w, 3) of a view."""
        surface = view.surface
        picture = self._background.copy()
        v, u = np.nonzero((surface.label >= 0) & (surface.label <= FOREARM))
        label, normal = surface.label[v, u], surface.normal[v, u]
        points = self._camera.unproject(np.stack([u, v], axis=-1), surface.depth[v, u])
        albedo = self._skin(points, normal, label, view.transforms)
        picture[v, u] = np.rint(255 * srgb_from_linear(self._light.on(albedo, normal, shine=True)))
        if self._noise == 0:
            return picture
        noise = self._noise * coarse_normal_noise(rng, picture.shape)
        return np.asarray(cv2.add(picture, np.rint(noise), dtype=cv2.CV_8U), dtype=np.uint8)

    def _skin(self, points: Array, normal: Array, label: NDArray[np.int16], transforms: Array) -> Array:
        """Albedo (N, 3) at camera-frame points (N, 3): it moves with the hand, for it depends on the point at rest."""
        T = (self._T_rest_body @ np.linalg.inv(transforms))[label]
        at_rest = np.einsum("nij,nj->ni", T[:, :3, :3], points) + T[:, :3, 3]
        inward = np.einsum("nj,nj->n", transforms[label, :3, 2], normal)
        # From the back (0) to the palm's side (1), over the fingers' edges.
        palmar = np.clip(0.5 + 1.2 * inward, 0, 1)[:, None]
        albedo = self._tone.back + (palmar**2 * (3 - 2 * palmar)) * (self._tone.palm - self._tone.back)
        blotches = np.sin(at_rest.astype(np.float32) @ self._waves.T + self._phases).sum(axis=-1) / np.sqrt(3)
        # Blood under the skin takes away green and blue rather than red.
        return np.asarray(albedo * (1 + blotches[:, None] * np.array([0.02, 0.045, 0.045])))


def flip_skin(
    colour: Image, label: NDArray[np.int16], share: float, tone: SkinTone, rng: np.random.Generator
) -> tuple[Image, Mask]:
    """Skin labels (h, w) with a share of all pixels flipped, and RGB (h, w, 3) in which they look flipped.

    Oikonomidis et al. 2011, Fig. 2c: each pixel flips by itself. Flipped skin takes on the colour of something else,
    anything else that flips takes on skin's.
    """
    skin = (label >= 0) & (label <= FACE)
    if share == 0:
        return colour, skin
    flipped = rng.random(label.shape) < share
    out = colour.copy()
    lost, gained = flipped & skin, flipped & ~skin
    out[lost] = _NOT_SKIN[rng.integers(len(_NOT_SKIN), size=int(lost.sum()))]
    brightness = rng.uniform(0.6, 1.0, int(gained.sum()))
    out[gained] = np.rint(255 * srgb_from_linear(tone.palm * brightness[:, None])).astype(np.uint8)
    return out, skin ^ flipped


_NOT_SKIN = np.array([(40, 90, 200), (30, 140, 60), (20, 160, 170), (90, 60, 190), (60, 60, 70)], dtype=np.uint8)
"""Blue, green, teal, violet and slate: far from every skin."""


def _at_rest(shape: HandShape) -> Array:
    """T_rest_body (17, 4, 4): the bodies and the forearm of the hand at rest, in the palm frame."""
    rest = np.zeros(27)
    rest[3] = 1
    transforms = np.tile(np.eye(4), (BODY_COUNT + 1, 1, 1))
    transforms[:BODY_COUNT] = HandModel(shape).transforms(rest)
    return transforms
