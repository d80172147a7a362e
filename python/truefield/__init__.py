"""Distance fields that people can trust: every distance comes with an interval that contains the truth."""

from truefield import csg, implicit, patches, polygons, shapes
from truefield._truefield import __version__
from truefield.adaptive import AdaptiveField, RayHits, adaptive_field
from truefield.check import MeshCheck
from truefield.cloud import PointCloud
from truefield.collision import Collision, collide
from truefield.errors import FileError, TruefieldError
from truefield.fields import CompleteField, SignRule, Surface, complete_field
from truefield.io import read, read_points
from truefield.mesh import TriangleMesh
from truefield.nearest import Nearest
from truefield.sampled import SampledField
from truefield.sampling import Voxels, sampled_field, voxelize
from truefield.shape import Shape
from truefield.storage import load
from truefield.thickness import ThicknessReport, thickness
from truefield.transform import DistanceTransform, distance_transform, voronoi
from truefield.volume import Volume, read_volume

__all__ = [
    "AdaptiveField",
    "Collision",
    "CompleteField",
    "DistanceTransform",
    "FileError",
    "MeshCheck",
    "Nearest",
    "PointCloud",
    "RayHits",
    "SampledField",
    "Shape",
    "SignRule",
    "Surface",
    "ThicknessReport",
    "TriangleMesh",
    "TruefieldError",
    "Volume",
    "Voxels",
    "__version__",
    "adaptive_field",
    "collide",
    "complete_field",
    "csg",
    "distance_transform",
    "implicit",
    "load",
    "patches",
    "polygons",
    "read",
    "read_points",
    "read_volume",
    "sampled_field",
    "shapes",
    "thickness",
    "voronoi",
    "voxelize",
]
