"""Conversion of light to a photograph: exposure, white balance, filmic curve, vignette, blur and noise."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.types import ByteArray, FloatArray


@dataclass(frozen=True, slots=True)
class Film:
    """Imperfections of a cheap colour camera; each photograph draws random values within these ranges."""

    exposure_stops: float = 0.15
    """Auto exposure is wrong by up to this many stops either way."""
    white_balance: float = 0.03
    """The gains of red, green and blue are wrong by up to this share each."""
    noise: tuple[float, float] = (0.004, 0.010)
    """Range of n. The noise's standard deviation at a value v, both of full scale, is n (0.6 + sqrt(v)) in
    green and 0.7 of that in red and blue."""
    blur_px: tuple[float, float] = (0.35, 0.5)
    """Range of the standard deviation of the Gaussian blur by lens and demosaicing."""
    vignette: tuple[float, float] = (0.08, 0.16)
    """Range of the share of light that is lost in the corners."""


def develop(radiance: FloatArray, film: Film, rng: np.random.Generator) -> ByteArray:
    """Return the (H, W, 3) uint8 sRGB photograph of finite (H, W, 3) linear light."""
    height, width = radiance.shape[:2]
    gain = np.float32(
        _auto_exposure(radiance) * 2.0 ** rng.uniform(-film.exposure_stops, film.exposure_stops)
    )
    balance = _auto_white(radiance) * (1.0 + rng.uniform(-film.white_balance, film.white_balance, 3))
    y, x = np.ogrid[:height, :width]
    r2 = ((x / (width - 1) - 0.5) ** 2 + (y / (height - 1) - 0.5) ** 2) * 2.0
    shade = (1.0 - float(rng.uniform(*film.vignette)) * r2).astype(np.float32)[..., None]
    light = cv2.GaussianBlur(
        radiance * (balance.astype(np.float32) * gain * shade), (0, 0), rng.uniform(*film.blur_px)
    )
    value = _filmic(light)
    noise = rng.standard_normal(value.shape, dtype=np.float32)
    grain = 0.5 * noise + 0.5 * noise[..., 1:2]  # mostly luminance, some colour
    value += grain * (np.float32(rng.uniform(*film.noise)) * (np.float32(0.6) + np.sqrt(value)))
    return np.clip(value * 255.0 + 0.5, 0.0, 255.0).astype(np.uint8)


def _auto_exposure(radiance: FloatArray) -> float:
    """Return the gain that brings the picture's log mean to middle grey and keeps most highlights."""
    luminance = radiance[::4, ::4] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    middle = np.exp(np.log(luminance + 1e-4).mean())
    bright = float(np.percentile(luminance, 97.0)) + 1e-4
    return min(0.20 / float(middle), 1.6 / bright)


def _auto_white(radiance: FloatArray) -> FloatArray:
    """Return (3,) gains of red, green and blue that go two thirds of the way to a grey world."""
    mean = radiance[::4, ::4].reshape(-1, 3).mean(axis=0) + 1e-4
    return (mean[1] / mean) ** 0.66


def _filmic(light: FloatArray) -> FloatArray:
    """Return sRGB, 0 to 1, of light through a soft-shouldered curve, by table: exact to 1/4 grey level."""
    index = np.minimum(np.sqrt(np.maximum(light, 0.0) * np.float32(1.0 / 8.0)) * 4095.0, 4095.0).astype(
        np.uint16
    )
    return _CURVE[index]


def _curve() -> FloatArray:
    light = 8.0 * np.linspace(0.0, 1.0, 4096) ** 2
    mapped = light * (1.0 + light / 9.0) / (1.0 + light)  # Reinhard's curve, 1 for a light of 3
    mapped = np.clip(mapped * 1.15, 0.0, 1.0)
    srgb = np.where(mapped <= 0.0031308, 12.92 * mapped, 1.055 * mapped ** (1 / 2.4) - 0.055)
    return srgb.astype(np.float32)


_CURVE = _curve()
