"""Vibration as people feel it: the weightings W_k and W_d of ISO 2631-1:1997, annex A, in the frequency domain."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

_BAND: Final = (0.4, 100.0)
"""Corners of the band limits, Butterworth of second order [Hz]; common to both."""
_FACTOR: Final = {"horizontal": 1.4, "vertical": 1.0}
"""By which health and comfort weigh the axes of a seated person, k_d and k_k."""


def weighted_rms(acceleration: FloatArray, period: float, axis: str) -> float:
    """Return the weighted acceleration [m/s^2] of one axis of a seat.

    Args:
        acceleration: Of the seat (N,) [m/s^2].
        period: Time between two values [s].
        axis: ``horizontal`` (W_d) or ``vertical`` (W_k).
    """
    spectrum = np.fft.rfft(acceleration - acceleration.mean())
    s = 2j * np.pi * np.maximum(np.fft.rfftfreq(len(acceleration), period), 1e-9)
    felt = np.fft.irfft(spectrum * _weighting(s, axis), len(acceleration))
    return _FACTOR[axis] * float(np.sqrt(np.mean(felt**2)))


def _weighting(s: ComplexArray, axis: str) -> ComplexArray:
    low, high = (2.0 * np.pi * corner for corner in _BAND)
    gain: ComplexArray = 1.0 / (1.0 + np.sqrt(2.0) * low / s + (low / s) ** 2)
    gain = gain / (1.0 + np.sqrt(2.0) * s / high + (s / high) ** 2)
    if axis == "horizontal":
        gain = gain * _transition(s, 2.0, 2.0, 0.63)
    else:
        gain = gain * _transition(s, 12.5, 12.5, 0.63) * _step(s, 2.37, 0.91, 3.35, 0.91)
    return gain


def _transition(s: ComplexArray, f3: float, f4: float, q4: float) -> ComplexArray:
    """Acceleration to velocity: flat below f3 [Hz], falling above f4 [Hz]."""
    w3, w4 = 2.0 * np.pi * f3, 2.0 * np.pi * f4
    return (1.0 + s / w3) / (1.0 + s / (q4 * w4) + (s / w4) ** 2)


def _step(s: ComplexArray, f5: float, q5: float, f6: float, q6: float) -> ComplexArray:
    """Upward step from below f5 to above f6 [Hz]."""
    w5, w6 = 2.0 * np.pi * f5, 2.0 * np.pi * f6
    rise = 1.0 + s / (q5 * w5) + (s / w5) ** 2
    return (w5 / w6) ** 2 * rise / (1.0 + s / (q6 * w6) + (s / w6) ** 2)
