"""Areas of the table plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned area of the table plane, m, in base_link."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def __post_init__(self) -> None:
        if not (self.x_min < self.x_max and self.y_min < self.y_max):
            raise ValueError(
                f'Expected x_min < x_max and y_min < y_max, '
                f'got x {self.x_min:g} to {self.x_max:g} '
                f'and y {self.y_min:g} to {self.y_max:g}.'
            )

    @overload
    def contains(self, x: float, y: float, margin: float = 0.0) -> bool: ...

    @overload
    def contains(
        self, x: NDArray[np.floating], y: NDArray[np.floating], margin: float = 0.0
    ) -> NDArray[np.bool_]: ...

    def contains(
        self,
        x: float | NDArray[np.floating],
        y: float | NDArray[np.floating],
        margin: float = 0.0,
    ) -> bool | NDArray[np.bool_]:
        """Whether points lie inside, edges included, grown by a margin (m) on every side."""
        return (
            (x >= self.x_min - margin)
            & (x <= self.x_max + margin)
            & (y >= self.y_min - margin)
            & (y <= self.y_max + margin)
        )

    @property
    def centre(self) -> tuple[float, float]:
        """The middle, (x, y)."""
        return (self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2

    def corners(self) -> NDArray[np.float64]:
        """The four corners in order round the area, (4, 2)."""
        x0, x1, y0, y1 = self.x_min, self.x_max, self.y_min, self.y_max
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
