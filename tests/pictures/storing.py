"""Pictures as cameras and programs store them, with noise of 1 % of the full scale."""

from pathlib import Path
from typing import Any

import av
import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image

Levels = NDArray[np.float64]


def quantised(
    shares: Levels, noise: float, bits: int = 8, rng: int | np.random.Generator = 0
) -> NDArray[Any]:
    """Noise as a share of the full scale, rounded and clipped."""
    top = 2**bits - 1
    noisy = top * (shares + np.random.default_rng(rng).normal(0, noise, shares.shape))
    return np.clip(np.rint(noisy), 0, top).astype(np.uint8 if bits <= 8 else np.uint16)


def in_srgb(light: Levels) -> Levels:
    """The curve of IEC 61966-2-1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def png(pictures: Levels, folder: Path, rng: int | np.random.Generator = 0) -> None:
    for number, picture in enumerate(quantised(pictures, 0.01, rng=rng)):
        Image.fromarray(picture).save(folder / f"{number}.png")


def tiff_of_12_bits(pictures: Levels, folder: Path, rng: int | np.random.Generator = 0) -> None:
    deep = quantised(pictures, 0.01, bits=12, rng=rng)
    tifffile.imwrite(folder / "stack.tif", deep, photometric="minisblack")


def jpeg_in_srgb(pictures: Levels, folder: Path, rng: int | np.random.Generator = 0) -> None:
    for number, picture in enumerate(quantised(in_srgb(pictures), 0.01, rng=rng)):
        Image.fromarray(picture).save(folder / f"{number}.jpg", quality=85)


def video(pictures: Levels, folder: Path, rng: int | np.random.Generator = 0) -> None:
    with av.open(str(folder / "film.mp4"), "w") as container:
        stream: Any = container.add_stream("libx264", rate=25, options={"crf": "18"})
        stream.height, stream.width = pictures.shape[1:]
        stream.pix_fmt = "yuv420p"
        for picture in quantised(pictures, 0.01, rng=rng):
            frame = av.VideoFrame.from_ndarray(np.repeat(picture[..., None], 3, 2), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def bayer_under_red_light(
    pictures: Levels, folder: Path, rng: int | np.random.Generator = 0
) -> None:
    seen = 0.08 * pictures  # green pixels
    seen[:, ::2, ::2] = pictures[:, ::2, ::2]
    seen[:, 1::2, 1::2] = 0.03 * pictures[:, 1::2, 1::2]
    np.save(folder / "raw.npy", quantised(seen, 0.01, rng=rng))
