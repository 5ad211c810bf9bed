"""What rays meet, in double precision and triangle by triangle."""

import numpy as np

# Of a cosine whose vectors are in single precision.
ROUNDING = 1e-6


class Judge:
    """What rays meet, in double precision: every triangle that a ray hits for certain, and every one that it may hit, when all
    coordinates are off by up to `blur` (gmlc rounds places to single precision after the origin was moved, the peers before)."""

    def __init__(self, vertices, triangles, limit):
        self.corners = np.asarray(vertices, np.float64)[triangles]
        self.centers = self.corners.mean(axis=1)
        self.radii = np.linalg.norm(self.corners - self.centers[:, None], axis=2).max(axis=1)
        used = self.corners.reshape(-1, 3)
        # gmlc's distance that single precision cannot tell from zero: 2^-20 of the largest coordinate from the centre.
        self.blur = 2.0**-20 * (used.max(axis=0) - used.min(axis=0)).max() / 2
        self.limit = limit

    def hits(self, origin, direction, normal=None):
        """(nearest, farthest place, certain) of every triangle that the ray may hit; places are intervals of t. With a normal only
        triangles count that make less than a right angle with it."""
        direction = direction / np.linalg.norm(direction)
        away = self.centers - origin
        across = away - np.outer(away @ direction, direction)
        near = np.flatnonzero((across**2).sum(axis=1) <= (self.radii + self.blur) ** 2)
        corners = self.corners[near] - origin
        along = corners @ direction
        flat = corners - along[..., None] * direction
        # How far the ray passes each edge, on the side of the triangle where it is positive.
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normals @ direction
        side = np.where(facing >= 0, 1.0, -1.0)
        passes = []
        for k in range(3):
            a, b = flat[:, k], flat[:, (k + 1) % 3]
            length = np.maximum(np.linalg.norm(b - a, axis=1), 1e-300)
            passes.append(side * (np.cross(a, b) @ direction) / length)
        least = np.min(passes, axis=0)
        cosine = np.abs(facing) / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
        certain = (least > self.blur) & (cosine > 1e-3)
        t = np.einsum("ij,ij->i", normals, corners[:, 0]) / np.where(facing == 0, np.inf, facing)
        off = self.blur * (1 + 1 / np.maximum(cosine, 1e-9))
        # A triangle seen edge-on lies somewhere between its corners.
        lowest, highest = along.min(axis=1) - self.blur, along.max(axis=1) + self.blur
        low, high = np.maximum(t - off, lowest), np.minimum(t + off, highest)
        edge_on = ~(low <= high)
        low, high = np.where(edge_on, lowest, low), np.where(edge_on, highest, high)
        possible = least > -self.blur
        if normal is not None:
            agreement = normals @ normal / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
            possible &= agreement > -ROUNDING
            certain &= agreement > ROUNDING
        return list(zip(low[possible], high[possible], certain[possible]))

    def agrees(self, hits, found):
        """Whether a distance (infinite: nothing was hit) is that of the nearest hit ahead. What lies within the blur of the origin may
        count as ahead or as behind."""
        for low, high, certain in hits:
            if certain and low > self.blur and high < min(found, self.limit) - self.blur:
                return False
        if not np.isfinite(found):
            return True
        return any(low - self.blur <= found <= high + self.blur and high >= -self.blur for low, high, _ in hits)
