"""Results of sqslam as NumPy arrays; fits of superquadrics; pictures of maps. Examples: docs/library.md."""
import pathlib
import sys


def _check_vtk():
    """Raises ImportError if another copy of VTK is loaded: its OpenGL needs a display and would crash."""
    with open("/proc/self/maps", encoding="utf-8", errors="replace") as maps:
        names = {line.rsplit("/", 1)[-1].strip() for line in maps if "/" in line}
    if any(name.startswith(("libvtk", "libGLEW")) for name in names):
        raise ImportError("sqslam: another module has already loaded VTK, expected `import sqslam` first")


if "sqslam._sqslam" not in sys.modules:
    _check_vtk()

from . import _sqslam  # noqa: E402
from ._sqslam import (Fit, InputError, Object, Result, State, Superquadric, UsageError,  # noqa: E402
                      __version__, distance, fit, iou, read, render)

__all__ = ["Fit", "InputError", "Object", "Result", "State", "Superquadric", "UsageError", "__version__", "distance", "fit",
           "iou", "read", "render"]

_PREFIX = pathlib.Path(__file__).resolve().parents[4]  # of PREFIX/lib/python3/dist-packages/sqslam, or the sources
for _folder in (_PREFIX / "share" / "sqslam", _PREFIX):
    if (_folder / "configs").is_dir():
        _sqslam.set_data_folder(str(_folder))
        break
