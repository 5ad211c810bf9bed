"""A mesh in double precision, and what other programs find on it."""

import numpy as np

from judge import ROUNDING


class Triangles:
    def __init__(self, vertices, triangles):
        self.vertices, self.triangles = vertices, triangles
        self.corners = vertices[triangles]
        across = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        self.normals = across / np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
        self.centers = self.corners.mean(axis=1)
        self.radii = np.linalg.norm(self.corners - self.centers[:, None], axis=2).max(axis=1)

    @classmethod
    def read(cls, path):
        """From a PLY file, by whichever package there is."""
        try:
            import igl

            vertices, triangles = igl.read_triangle_mesh(str(path))
        except ImportError:
            import open3d

            mesh = open3d.io.read_triangle_mesh(str(path))
            vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
        return cls(np.asarray(vertices, np.float64, order="C"), np.asarray(triangles, np.int64, order="C"))

    def open_edges(self):
        """The number of edges that do not belong to two triangles."""
        edges = np.sort(np.concatenate([self.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        return int((np.unique(edges, axis=0, return_counts=True)[1] != 2).sum())

    def nearest_by_libigl(self, igl, places):
        """Distances, triangles and closest points."""
        squared, index, closest = igl.point_mesh_squared_distance(np.ascontiguousarray(places), self.vertices, self.triangles)
        return np.sqrt(squared), index, closest

    def scene(self, open3d):
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(self.vertices.astype(np.float32), self.triangles.astype(np.uint32))
        return scene

    def nearest_by_open3d(self, open3d, places):
        found = self.scene(open3d).compute_closest_points(places.astype(np.float32))
        closest = found["points"].numpy().astype(np.float64)
        distance = self.scene(open3d).compute_distance(places.astype(np.float32)).numpy().astype(np.float64)
        return distance, found["primitive_ids"].numpy().astype(np.int64), closest

    def faces(self, index, normal):
        """Whether triangles make less than a right angle with normals."""
        return np.einsum("ij,ij->i", self.normals[index], normal) > 0

    def hits_by_open3d(self, open3d, places, normals, _blur):
        """Distances along +normal and -normal to the nearest triangle that faces the same way; infinite where there is none."""
        both = np.full((len(places), 2), np.inf)
        scene = self.scene(open3d)
        for side, sign in enumerate((1, -1)):
            found = scene.list_intersections(np.hstack([places, sign * normals]).astype(np.float32))
            ray, index = found["ray_ids"].numpy().astype(np.int64), found["primitive_ids"].numpy().astype(np.int64)
            ahead = self.faces(index, normals[ray])
            np.minimum.at(both[:, side], ray[ahead], found["t_hit"].numpy().astype(np.float64)[ahead])
        return both

    def hits_by_libigl(self, igl, places, normals, blur):
        """The same; libigl says which triangles are hit, and its distances are computed anew, because it returns them in single precision."""
        both = np.full((len(places), 2), np.inf)
        for i, (place, normal) in enumerate(zip(places, normals)):
            for side, sign in enumerate((1, -1)):
                found = igl.ray_mesh_intersect(place, sign * normal, self.vertices, self.triangles)
                index = np.array([hit[0] for hit in found or []], np.int64)
                index = index[self.faces(index, np.broadcast_to(normal, (len(index), 3)))]
                if len(index):
                    height = np.einsum("ij,ij->i", self.normals[index], self.corners[index, 0] - place)
                    both[i, side] = (height / (self.normals[index] @ (sign * normal))).min()
        return both

    def nearest_facing(self, place, normal, reach):
        """The distance to the nearest triangle that makes less than a right angle with a normal, of all within reach; infinite where there
        is none."""
        near = np.flatnonzero(np.linalg.norm(self.centers - place, axis=1) - self.radii <= reach)
        near = near[self.normals[near] @ normal > -ROUNDING]
        return np.sqrt(squared_distances(place, self.corners[near])).min(initial=np.inf)


def squared_distances(place, corners):
    """From a place to triangles: to their planes where it lies above them, otherwise to their sides."""
    a = corners[:, 0]
    across = np.cross(corners[:, 1] - a, corners[:, 2] - a)
    length = np.einsum("ij,ij->i", across, across)
    height = np.einsum("ij,ij->i", across, place - a)
    inside = length > 0
    nearest = np.full(len(corners), np.inf)
    for k in range(3):
        p, q = corners[:, k], corners[:, (k + 1) % 3]
        side = q - p
        along = np.einsum("ij,ij->i", place - p, side) / np.maximum(np.einsum("ij,ij->i", side, side), 1e-300)
        foot = p + np.clip(along, 0, 1)[:, None] * side
        nearest = np.minimum(nearest, ((place - foot) ** 2).sum(axis=1))
        inside &= np.einsum("ij,ij->i", np.cross(side, place - p), across) >= 0
    return np.where(inside, np.minimum(nearest, height**2 / np.maximum(length, 1e-300)), nearest)
