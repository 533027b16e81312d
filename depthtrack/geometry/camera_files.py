"""Camera files of other tools: JSON of Open3D and RealSense, YAML of ROS, Kalibr and OpenCV.

Each is reduced to the numbers of a pinhole camera and the coefficients of its lens distortion.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.files import read_json, read_text
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion
from depthtrack.strict_data import check_plain

_SIZES = (("width", "height"), ("image_width", "image_height"), ("w", "h"))
_MATRICES = ("intrinsic_matrix", "camera_matrix", "K", "k", "intrinsics")
_COEFFICIENTS = ("distortion", "distortion_coefficients", "distortion_coeffs", "dist_coeffs", "coeffs", "D", "d")
_NAMED_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_MODELS = {"radtan": "plumb_bob", "brown_conrady": "plumb_bob", "none": ""}
"""Names of the distortion of ROS by those of Kalibr and RealSense."""
_NESTED = ("intrinsic", "intrinsics", "cam0", "camera", "depth", "depth_intrinsics")
_MOST_LEVELS = 3
_MOST_YAML = 1 << 16
"""Bytes of a YAML file: its library reads a larger one for seconds."""


@dataclass(frozen=True)
class CameraFile:
    """A camera with the distortion of its images.

    distortion: coefficients k1, k2, p1, p2, k3, k4, k5, k6 as in OpenCV; empty without distortion.
    notes: sentences for the user on what was assumed.
    """

    camera: Camera
    distortion: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def read_camera(path: Path) -> CameraFile:
    """Return the camera of a JSON or YAML file.

    Raises:
        InputError: if the file is missing or malformed, a value is out of range, or the distortion is of another model.
        MissingExtraError: if YAML is to be read without its library.
    """
    if path.suffix.lower() in (".yaml", ".yml"):
        fields = _read_yaml(path)
        try:
            return camera_of(fields)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        except (ValueError, TypeError, AttributeError, IndexError, OverflowError, RecursionError) as error:
            raise InputError(f"cannot read the camera file {path}: {error!s:.120}") from error
    return read_json(path, "the camera file", camera_of)


def camera_of(fields: Any) -> CameraFile:
    """Return the camera of the parsed contents of a file.

    Raises:
        InputError: if an entry is missing or out of range.
    """
    for _ in range(_MOST_LEVELS):
        if not isinstance(fields, Mapping) or _has_focal_length(fields):
            break
        inner = next((fields[name] for name in _NESTED if isinstance(fields.get(name), Mapping)), None)
        if inner is None:
            break
        fields = {**{name: value for name, value in fields.items() if name not in _NESTED}, **inner}
    if not isinstance(fields, Mapping):
        return CameraFile(Camera.from_fields(fields))
    known, notes = dict(fields), list[str]()
    _fill_size(known)
    _fill_matrix(known)
    if isinstance(known.get("depth_scale"), int | float) and "intrinsic_matrix" in known and known["depth_scale"] >= 1:
        known["depth_scale"] = 1 / known["depth_scale"]  # Open3D states units per metre
    if _is_number(known.get("fy")) and known["fy"] < 0 < known.get("fx", 0):
        known["fy"] = -known["fy"]
        notes.append("fy of the camera is negative: its rows are taken from the top, as those of the images")
    camera = Camera.from_fields(known)
    if "depth_scale" not in known:
        notes.append("the camera file states no depth_scale: a unit of depth is 1 mm (--depth-scale states another)")
    return CameraFile(camera, _distortion(known), tuple(notes))


def _has_focal_length(fields: Mapping[str, Any]) -> bool:
    return "fx" in fields or any(_numbers(fields.get(name)) for name in _MATRICES)


def _fill_size(fields: dict[str, Any]) -> None:
    """Add width and height, as whole numbers."""
    for across, down in _SIZES:
        if across in fields and down in fields:
            fields.setdefault("width", fields[across])
            fields.setdefault("height", fields[down])
    resolution = fields.get("resolution")
    if isinstance(resolution, list) and len(resolution) == 2:
        fields.setdefault("width", resolution[0])
        fields.setdefault("height", resolution[1])
    for name in ("width", "height"):
        if isinstance(fields.get(name), float) and fields[name].is_integer():
            fields[name] = int(fields[name])


def _fill_matrix(fields: dict[str, Any]) -> None:
    """Add focal lengths and principal point of a matrix, or of Kalibr's list fu fv pu pv."""
    for name, other in (("cx", "ppx"), ("cy", "ppy")):
        if other in fields:
            fields.setdefault(name, fields[other])
    for name in _MATRICES:
        numbers = _numbers(fields.get(name))
        if len(numbers) == 4:
            values = numbers
        elif len(numbers) == 9:
            # Open3D writes columns, all others rows; the principal point is where no zero is.
            columns = numbers[2] == numbers[5] == 0
            values = [numbers[0], numbers[4], *(numbers[6:8] if columns else (numbers[2], numbers[5]))]
        else:
            continue
        for entry, value in zip(("fx", "fy", "cx", "cy"), values, strict=True):
            fields.setdefault(entry, value)


def _distortion(fields: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the coefficients of the distortion; empty if it moves nothing. Raises InputError."""
    coefficients = next((_numbers(fields[name]) for name in _COEFFICIENTS if name in fields), [])
    coefficients = coefficients or [fields.get(name, 0) for name in _NAMED_COEFFICIENTS]
    if not all(map(_is_number, coefficients)):
        raise InputError(f"lens distortion must be numbers, found {coefficients!r:.80}")
    stated = str(fields.get("distortion_model", fields.get("model", ""))).lower().rpartition(".")[2]
    found = Distortion.of(_MODELS.get(stated, stated), coefficients)
    return () if found is None else found.coefficients


def _numbers(value: Any) -> list[float]:
    """Return the numbers of a list, of its rows, or of the data of a matrix; else none."""
    data = value.get("data") if isinstance(value, Mapping) else value
    if not isinstance(data, list) or len(data) > 64:
        return []
    flat = [each for row in data for each in (row if isinstance(row, list) else [row])]
    return flat if all(map(_is_number, flat)) else []


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _read_yaml(path: Path) -> Any:
    """Return the contents of a YAML file, also of OpenCV's dialect."""
    try:
        import yaml
    except ImportError as error:
        raise MissingExtraError("a camera in a YAML file", "yaml") from error
    lines = (line for line in read_text(path, _MOST_YAML).splitlines() if not line.startswith("%"))
    text = "\n".join(lines).replace("!!opencv-matrix", "")
    try:
        # Aliases of aliases are a few bytes for any number of values.
        if any(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)):
            raise InputError(f"{path} must have no aliases (*name), found some: write the values out")
        fields = _first_document(yaml.safe_load_all(text))
        check_plain(fields)
        return fields
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"cannot read the camera file {path}: {str(error).splitlines()[0]:.120}") from error


def _first_document(documents: Iterable[Any]) -> Any:
    return next((document for document in documents if document is not None), None)
