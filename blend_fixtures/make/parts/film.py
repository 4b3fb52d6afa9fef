"""From Cycles' pinhole picture to what a camera delivers: lens distortion, sensor noise, JPEG or grey PNG."""

import struct
import tempfile
import zlib
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .studio import Array, Lens

SUPERSAMPLE = 1.6
SUBPIXELS = 3
NOISE_SIGMA = 1.5
JPEG_QUALITY = 92


class Film:
    """Renders the open scene through a lens."""

    def __init__(self, scene: bpy.types.Scene, lens: Lens, seed: int, samples: int = 6) -> None:
        self.scene, self.lens = scene, lens
        self.random = np.random.default_rng(seed)
        self.focal = SUPERSAMPLE * lens.fx
        offsets = (np.arange(SUBPIXELS) + 0.5) / SUBPIXELS - 0.5
        u, v = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
        pixels: Array = np.stack([u, v], -1).astype(float)
        rays = [lens.undistort(pixels + np.array([du, dv], float)) for dv in offsets for du in offsets]
        extent = np.max([np.abs(r).max((0, 1)) for r in rays], axis=0)
        self.size = (2 * np.ceil(extent * self.focal + 3)).astype(int)
        self.maps = [r * self.focal + (self.size - 1) / 2 for r in rays]
        self._set_up(samples)

    def _set_up(self, samples: int) -> None:
        scene, cycles = self.scene, self.scene.cycles
        scene.render.engine = "CYCLES"
        cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", samples, False
        cycles.use_denoising, cycles.denoiser = True, "OPENIMAGEDENOISE"
        cycles.denoising_input_passes, cycles.denoising_prefilter = "RGB_ALBEDO_NORMAL", "FAST"
        cycles.max_bounces, cycles.transparent_max_bounces = 3, 6
        scene.render.use_persistent_data = True
        scene.render.resolution_x, scene.render.resolution_y = (int(n) for n in self.size)
        scene.render.resolution_percentage = 100
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "16"
        scene.view_settings.view_transform = "Standard"
        camera = scene.camera.data
        camera.sensor_fit, camera.sensor_width = "HORIZONTAL", 36.0
        camera.lens = 36.0 * self.focal / float(self.size[0])
        camera.clip_start = 0.01

    def shoot(self, frame: int, gain: float) -> NDArray[np.uint8]:
        """The picture at a frame of the scene, (height, width, 3) sRGB, top row first."""
        self.scene.frame_set(frame)
        self.scene.cycles.seed = frame
        linear = self._render()
        total = sum(_sample(linear, m) for m in self.maps) / len(self.maps)
        light = np.clip(gain * total, 0, 1)
        srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        noisy = 255 * srgb + NOISE_SIGMA * self.random.standard_normal(srgb.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    def _render(self) -> Array:
        with tempfile.TemporaryDirectory() as folder:
            self.scene.render.filepath = str(Path(folder) / "render.exr")
            bpy.ops.render.render(write_still=True)
            picture = bpy.data.images.load(self.scene.render.filepath)
            width, height = picture.size
            pixels = np.empty(width * height * picture.channels, np.float32)
            picture.pixels.foreach_get(pixels)
            bpy.data.images.remove(picture)
        self.scene.render.filepath = "//"
        return pixels.reshape(height, width, -1)[::-1, :, :3].astype(float)


def write_jpeg(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write (height, width, 3) sRGB."""
    height, width = picture.shape[:2]
    image = bpy.data.images.new("jpeg", width, height, alpha=False)
    values = np.ones((height, width, 4), np.float32)
    values[..., :3] = picture[::-1].astype(np.float32) / 255
    image.pixels.foreach_set(values.ravel())
    image.file_format = "JPEG"
    image.save(filepath=str(path), quality=JPEG_QUALITY, save_copy=True)
    bpy.data.images.remove(image)


def write_grey_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write the luma of (height, width, 3) as an 8-bit grey PNG."""
    grey = np.rint(picture.astype(float) @ [0.299, 0.587, 0.114]).astype(np.uint8)
    difference = grey.copy()
    difference[1:] -= grey[:-1]
    rows = np.column_stack([np.full(len(grey), 2, np.uint8), difference]).tobytes()
    height, width = grey.shape
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows, 9)),
        (b"IEND", b""),
    ]
    encoded = [struct.pack(">I", len(d)) + tag + d + struct.pack(">I", zlib.crc32(tag + d)) for tag, d in chunks]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(encoded))


def _sample(picture: Array, at: Array) -> Array:
    """Bilinear samples."""
    x, y = at[..., 0], at[..., 1]
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    tx, ty = (x - x0)[..., None], (y - y0)[..., None]
    upper = picture[y0, x0] * (1 - tx) + picture[y0, x0 + 1] * tx
    lower = picture[y0 + 1, x0] * (1 - tx) + picture[y0 + 1, x0 + 1] * tx
    return upper * (1 - ty) + lower * ty
