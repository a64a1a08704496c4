"""Seamless grey noise, for fabrics, skin, grounds and clouds."""

from functools import lru_cache

import numpy as np

from protocol.arrays import Float32Array


@lru_cache(maxsize=64)
def seamless_noise(size: int, roughness: float, stretch: float, seed: int) -> Float32Array:
    """(size, size) noise of mean 0 and standard deviation 1 that repeats without a seam.

    Args:
        roughness: power of the frequency by which amplitude falls: 0 is white, 1 fabric, 2 clouds.
        stretch: above 1, features are that many times longer across than along the columns; below 1, the reverse.
        seed: of the noise; the same arguments give the same noise.
    """
    white = np.fft.rfft2(np.random.default_rng(seed).standard_normal((size, size)))
    rows, columns = np.fft.fftfreq(size)[:, None] * size, np.fft.rfftfreq(size)[None] * size
    frequency = np.hypot(rows, columns * stretch)
    frequency[0, 0] = np.inf
    made = np.fft.irfft2(white / frequency**roughness, (size, size))
    noise = (made / made.std()).astype(np.float32)
    noise.flags.writeable = False
    return noise


def shifted(noise: Float32Array, random: np.random.Generator) -> Float32Array:
    """The same noise from another corner, mirrored or not: another appearance at little cost."""
    rows, columns = (int(random.integers(size)) for size in noise.shape)
    turned = noise[:, ::-1] if random.random() < 0.5 else noise
    return np.roll(turned, (rows, columns), axis=(0, 1))
