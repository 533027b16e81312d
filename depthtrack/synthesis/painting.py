"""Colour images: random skin colours and texture, lighting and camera noise."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.backdrop import FACE, FOREARM, Backdrop
from depthtrack.synthesis.colour import linear_from_lab, srgb_from_linear
from depthtrack.synthesis.held_object import HELD
from depthtrack.synthesis.randomness import rounded_normal_noise
from depthtrack.synthesis.scene import RenderedView
from depthtrack.types import Array, Array32, Image, Mask


@dataclass(frozen=True)
class SkinTone:
    """Skin colours of one person.

    back (3,), palm (3,): linear RGB of the hand's back and of the paler palm.

    Lightness L* follows the individual typology angle ITA = atan((L* - 50) / b*). It runs from about 55 degrees in
    light skin to -35 in dark skin.

    - ITA: Chardon, Cretois and Hourseau, "Skin colour typology and suntanning pathways", 1991.
    - Its range: Del Bino and Bernerd, "Variations in skin colour and the biological consequences of ultraviolet
      radiation exposure", 2013.
    - Means a* = 9.6, b* = 17.1: Han, Choi and Son, "Skin color of Koreans", 2006.
    - Palms have less pigment: Yamaguchi et al., "Mesenchymal-epithelial interactions in the skin", 2004.
    """

    back: Array
    palm: Array

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Self:
        """Return the skin colours of a random person."""
        angle = np.radians(rng.uniform(-30, 50))
        a, b = rng.normal(9.6, 1.0), rng.normal(17.1, 1.2)
        lightness = 50 + b * np.tan(angle)
        paler = lightness + 0.5 * max(66 - lightness, 0)
        return cls(linear_from_lab(np.array([lightness, a, b])), linear_from_lab(np.array([paler, a + 3, b - 1])))


@dataclass(frozen=True)
class Light:
    """A directional lamp behind the camera and ambient light.

    towards (3,): unit vector from the scene to the lamp, camera frame.
    ambient, lamp, shine: intensities of ambient, diffuse and specular light.
    """

    towards: Array
    ambient: float
    lamp: float
    shine: float = 0.03

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Self:
        """Return random lighting."""
        towards = np.array([rng.uniform(-0.5, 0.5), rng.uniform(-0.8, -0.2), -1.0])
        ambient = rng.uniform(0.35, 0.5)
        return cls(towards / np.linalg.norm(towards), ambient, 1.05 - ambient)

    def reflected(self, albedo: Array, normal: Array, shine: bool = False) -> Array:
        """Return the reflected light of surfaces: Lambert, plus Blinn-Phong if `shine`.

        albedo (..., 3): linear RGB.
        normal (..., 3): unit vectors, camera frame.
        Result (..., 3): linear RGB.
        """
        facing = np.maximum(normal @ self.towards, 0)
        light = albedo * (self.ambient + self.lamp * facing)[..., None]
        if shine:
            light = light + self.shine * (np.maximum(normal @ self.halfway, 0) ** 20)[..., None]
        return np.asarray(light)

    @cached_property
    def halfway(self) -> Array:
        """Return the unit vector (3,) between the directions to the lamp and to the camera."""
        halfway = self.towards - np.array([0, 0, 1])
        return np.asarray(halfway / np.linalg.norm(halfway))


class Painter:
    """Colour images of one recording; the backdrop is painted once.

    held (3,): linear RGB of the object in the hand.
    """

    def __init__(
        self,
        shape: HandShape,
        camera: Camera,
        backdrop: Backdrop,
        tone: SkinTone,
        noise: float,
        rng: np.random.Generator,
        held: Array | None = None,
    ) -> None:
        self._camera = camera
        self._tone = tone
        self._noise = noise
        self._held = held
        self._light = Light.sample(rng)
        # Contiguous: numpy multiplies a transposed view a hundred times slower.
        self._waves = np.ascontiguousarray(rng.normal(0, 2 * np.pi / 0.03, (6, 3)).astype(np.float32).T)
        self._phases = rng.uniform(0, 2 * np.pi, 6).astype(np.float32)
        self._T_palm_body = _neutral_transforms(shape)
        background = backdrop.surface
        light = self._light.reflected(backdrop.albedo(rng), background.normal) * (background.depth > 0)[..., None]
        self._background = np.rint(255 * srgb_from_linear(light)).astype(np.uint8)

    def paint(self, rendered: RenderedView, rng: np.random.Generator) -> Image:
        """Return the RGB image (h, w, 3) of a rendered frame."""
        surface = rendered.surface
        picture = self._background.copy()
        pixels, labels, normals = picture.reshape(-1, 3), surface.label.reshape(-1), surface.normal.reshape(-1, 3)
        at = np.flatnonzero((labels >= 0) & (labels <= FOREARM))
        points = self._camera.unproject_rows(at, surface.depth)
        pixels[at] = np.rint(255 * srgb_from_linear(self._skin(points, normals[at], labels[at], rendered.transforms)))
        if self._held is not None:
            at = np.flatnonzero(labels == HELD)
            pixels[at] = np.rint(255 * srgb_from_linear(self._light.reflected(self._held, normals[at])))
        if self._noise == 0:
            return picture
        noise = rounded_normal_noise(rng, picture.shape, self._noise)
        return np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), dtype=np.uint8)

    def _skin(self, points: Array, normal: Array, label: NDArray[np.int16], transforms: Array) -> Array:
        """Return the light (N, 3), linear RGB, that skin reflects at camera-frame points (N, 3).

        The texture moves with the hand, since it is a function of the point in the neutral pose.
        """
        T = self._T_palm_body @ np.linalg.inv(transforms)
        neutral, colour = np.empty((len(points), 3), np.float32), np.empty((len(points), 3))
        tone = self._tone.back, self._tone.palm - self._tone.back
        place_on_skin(points, normal, label, T, transforms, tone, neutral, colour)
        light = self._light
        lamp = light.towards, light.halfway, (light.ambient, light.lamp, light.shine)
        light_skin(np.sin(neutral @ self._waves + self._phases), normal, lamp, colour)
        return colour


@compiled(nogil=True)
def place_on_skin(
    points: Array,
    normal: Array,
    label: NDArray[np.int16],
    T_neutral: Array,
    transforms: Array,
    tone: tuple[Array, Array],
    neutral: Array32,
    albedo: Array,
) -> None:
    """Write points in the neutral pose, and the albedo between the back and the palmar side.

    points, normal: (N, 3) metres and unit, camera frame.
    label: (N,) body of each point.
    T_neutral, transforms: (17, 4, 4) from the camera to the neutral pose, and T_camera_body, metres.
    tone: (3,) linear RGB of the back, and the difference of the palmar side.
    neutral, albedo: (N, 3) output, metres and linear RGB.
    """
    back, difference = tone
    for n in range(points.shape[0]):
        T, body = T_neutral[label[n]], transforms[label[n]]
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        inward = body[0, 2] * normal[n, 0] + body[1, 2] * normal[n, 1] + body[2, 2] * normal[n, 2]
        # 0 on the back of the hand, 1 on the palmar side, blended over the fingers' edges.
        palmar = min(max(0.5 + 1.2 * inward, 0.0), 1.0)
        share = palmar * palmar * (3.0 - 2.0 * palmar)
        for i in range(3):
            neutral[n, i] = T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3]
            albedo[n, i] = back[i] + share * difference[i]


@compiled(nogil=True)
def light_skin(
    waves: Array32, normal: Array, lamp: tuple[Array, Array, tuple[float, float, float]], out: Array
) -> None:
    """Replace the albedo of skin by reflected light, as `Light.reflected` with shine.

    waves: (N, 6) sines of the texture, which makes blotches.
    normal: (N, 3) unit, camera frame.
    lamp: (3,) directions to the lamp and halfway to the camera, then ambient, diffuse and specular intensity.
    out: (N, 3) albedo, then reflected light, linear RGB.
    """
    towards, halfway, (ambient, diffuse, specular) = lamp
    for n in range(out.shape[0]):
        blotches = np.float32(0.0)
        for k in range(waves.shape[1]):
            blotches += waves[n, k]
        share = blotches / math.sqrt(3.0)
        facing = normal[n, 0] * towards[0] + normal[n, 1] * towards[1] + normal[n, 2] * towards[2]
        glancing = normal[n, 0] * halfway[0] + normal[n, 1] * halfway[1] + normal[n, 2] * halfway[2]
        brightness, shine = ambient + diffuse * max(facing, 0.0), specular * max(glancing, 0.0) ** 20
        # Haemoglobin absorbs green and blue more than red.
        for i, strength in enumerate((0.02, 0.045, 0.045)):
            out[n, i] = out[n, i] * (1.0 + share * strength) * brightness + shine


def flip_skin(
    colour: Image, label: NDArray[np.int16], share: float, tone: SkinTone, rng: np.random.Generator
) -> tuple[Image, Mask]:
    """Flip the skin label of a share of all pixels and recolour them to match.

    Pixels flip independently. Flipped skin takes a random non-skin colour; all other flipped pixels take skin's.

    colour (h, w, 3): RGB.
    label (h, w): labels of the rendered surface.
    Result (h, w, 3) and (h, w): the new image and the new skin labels.
    Source: Oikonomidis et al. 2011, Fig. 2c.
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
"""Blue, green, teal, violet and slate: colours far from all skin colours."""


def _neutral_transforms(shape: HandShape) -> Array:
    """Return T_palm_body (17, 4, 4) of the bodies and the forearm in the neutral pose, metres."""
    neutral = np.zeros(27)
    neutral[3] = 1
    transforms = np.tile(np.eye(4), (BODY_COUNT + 1, 1, 1))
    transforms[:BODY_COUNT] = HandModel(shape).transforms(neutral)
    return transforms
