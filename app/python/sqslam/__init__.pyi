"""Results of sqslam as NumPy arrays; fits of superquadrics; pictures of maps.

Lengths are metres where the map's scale is known (`metric`) and map units where it is not, angles radians.
T_a_b maps a point given in frame b into frame a. Arrays are copies. Import sqslam before other modules that
load VTK.
"""
import os
from typing import Iterator, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class InputError(ValueError):
    """Input that cannot be used; the message names the file and what was expected."""

class UsageError(ValueError):
    """Invalid arguments."""

class Superquadric:
    """A superquadric placed in the map: Eq. 1 of the paper."""
    def __init__(self, half_size: ArrayLike, shape: Tuple[float, float], T_map_object: ArrayLike = ...) -> None: ...
    @property
    def half_size(self) -> NDArray[np.float64]:
        """(3,), along the object's axes."""
    @property
    def shape(self) -> Tuple[float, float]:
        """Exponents e1 (profile) and e2 (cross-section), from 0.1 (a box) over 1 (an ellipsoid) to 1.9."""
    @property
    def center(self) -> NDArray[np.float64]:
        """(3,), map frame."""
    @property
    def T_map_object(self) -> NDArray[np.float64]:
        """(4, 4)."""
    @property
    def parameters(self) -> NDArray[np.float64]:
        """(11,): half sizes, e1, e2, roll, pitch, yaw, centre."""
    @property
    def volume(self) -> float: ...

class Object(Superquadric):
    """An object of a map. Not a subclass of Superquadric at run time, but accepted wherever one is."""
    @property
    def id(self) -> int: ...
    @property
    def label(self) -> str: ...
    @property
    def name(self) -> str:
        """The name given by a person, or the label."""
    @property
    def score(self) -> float:
        """Mean score of the detector, [0, 1]."""
    @property
    def observations(self) -> int:
        """Number of frames with a box of the object."""
    @property
    def points(self) -> int:
        """Number of its map points."""
    @property
    def yaw(self) -> float: ...
    @property
    def reliability(self) -> float:
        """Estimate of the 3D IoU, [0, 1]."""
    @property
    def uncertain(self) -> bool:
        """True if more likely wrong than right."""

class Fit(Superquadric):
    """A superquadric of a cloud. Not a subclass of Superquadric at run time, but accepted wherever one is."""
    @property
    def rms(self) -> float:
        """Root mean square of the radial distances of the inliers."""
    @property
    def noise(self) -> float:
        """Standard deviation of the inliers from the surface."""
    @property
    def inlier_share(self) -> float: ...
    @property
    def inliers(self) -> NDArray[np.bool_]:
        """(N,), for each point of the cloud."""

class _Map:
    @property
    def poses(self) -> NDArray[np.float64]:
        """(N, 4, 4), T_map_camera of the keyframes."""
    @property
    def times(self) -> NDArray[np.float64]:
        """(N,), seconds."""
    @property
    def points(self) -> NDArray[np.float32]:
        """(M, 3), map frame."""
    @property
    def colors(self) -> NDArray[np.uint8]:
        """(M, 3), red green blue."""
    @property
    def point_objects(self) -> NDArray[np.int32]:
        """(M,), id of the object that the point belongs to, -1: none."""
    @property
    def objects(self) -> list[Object]: ...
    @property
    def K(self) -> NDArray[np.float64]:
        """(3, 3), camera matrix."""
    @property
    def distortion(self) -> list[float]:
        """k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4."""
    @property
    def fisheye(self) -> bool:
        """True if the distortion follows the fisheye model."""
    @property
    def image_size(self) -> Tuple[int, int]:
        """(width, height)."""
    @property
    def metric(self) -> bool:
        """True if lengths are metres."""
    def distance(self, points: ArrayLike, sigmas: float = 0.0) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Signed distances (N,) of points (N, 3) from the nearest object, negative inside, and their gradients (N, 3).
        `sigmas`: objects grow by so many standard deviations of their centres."""

class State(_Map):
    """The map at one moment of the run."""
    @property
    def frame(self) -> int: ...
    @property
    def time(self) -> float:
        """Seconds."""
    @property
    def image(self) -> str:
        """File of the frame's image; empty if the frame has none."""
    @property
    def pose(self) -> Optional[NDArray[np.float64]]:
        """(4, 4), T_map_camera of the frame; None while tracking was lost."""

class Result(_Map):
    """A finished run: the final map, and a sequence of its states. A notebook shows it as an interactive page."""
    @property
    def trajectory(self) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times (N,), poses (N, 4, 4) of all tracked frames."""
    @property
    def relations(self) -> list[Tuple[Union[int, str], str, Union[int, str], float]]:
        """(subject, relation, object, probability) as in relations.json: ids of objects, or "floor", "surface 0",
        "wall 1"; relations "on", "in", "under", "next to", "leans against"."""
    def query(self, question: str) -> list[Object]:
        """Objects that answer a question such as "cups on the table"; see `sqslam query --help`."""
    @property
    def sequence(self) -> str:
        """The input that was mapped."""
    @property
    def version(self) -> str:
        """The version of the program that mapped it."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> State: ...
    def __iter__(self) -> Iterator[State]: ...
    def page(self) -> str:
        """Self-contained HTML, as `sqslam export FILE.html` writes it."""
    def _repr_html_(self) -> str: ...

def read(result: Union[str, os.PathLike[str]], *, edits: str = "", reliable_only: bool = False) -> Result:
    """Opens a result folder or its map.sqmap.

    edits: a file with edits of the viewer, "auto" for the file beside the map. reliable_only: leaves out uncertain
    objects.
    Raises InputError.
    """

def fit(points: ArrayLike, *, upright: bool = False, clusters: Optional[int] = 1, remove_plane: bool = False,
        set: Sequence[str] = ()) -> list[Fit]:
    """Fits superquadrics to an N x 3 cloud, as `sqslam fit` does: one, or the largest `clusters`; None: all.

    set: further options, "fit.outlier_share=0.2". Raises InputError for fewer than 11 points or points that are not
    finite.
    """

def distance(solid: Union[Superquadric, Object, Fit],
             points: ArrayLike) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Signed distances (N,) of points (N, 3) from a solid, negative inside, and their gradients (N, 3)."""

def iou(a: Superquadric, b: Superquadric) -> float:
    """3D intersection over union in [0, 1], to 0.2 %."""

def render(map: Union[Result, State], *, width: int = 1280, height: int = 720, style: str = "paper",
           set: Sequence[str] = (), view: str = "", azimuth: float = 0.0, elevation: float = 0.0, zoom: float = 1.0,
           transparent: bool = False) -> NDArray[np.uint8]:
    """Draws a map without a display: (height, width, 3) RGB, or RGBA if transparent.

    style: a name in configs/styles or a FILE.yaml; set: style values, "objects.labels=true"; view: "top", "front", ...;
    azimuth and elevation: degrees, as in `sqslam render --camera-...`. Raises UsageError.
    """
