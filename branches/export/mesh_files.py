"""Write meshes of a strip as bytes of files for other programs, in the formats of trimesh and meshio."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from branches.draw.solid import Mesh
from branches.export import LIBRARIES
from branches.store.files import StoreError

#: Colour of the strip in formats with colours: the orange of the pictures (`branches.draw.strip.FRONT`), from 0 to 255.
_COLOUR = (232, 163, 61, 255)


def library(ending: str):
    """Return the library that writes files with this ending, or raise StoreError, which says what to install."""
    name = LIBRARIES[ending]
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise StoreError(
            f"{ending} files are written by {name}, which is not installed: pip install {name}, "
            'or pip install "ribbon-continuation[export]" for all formats'
        ) from error


def encode(mesh: Mesh, ending: str, fields: Mapping[str, np.ndarray]) -> bytes:
    """Return a mesh as the content of a file; raise StoreError where the library that writes this format is not installed.

    Parameters
    ----------
    mesh : Mesh
        Its third axis is up.
    ending : str
        One of `branches.export.LIBRARIES`.
    fields : mapping of str to ndarray, shape (K, ...)
        Values at the nodes of the centreline; VTK files hold them.
    """
    if LIBRARIES[ending] == "trimesh":
        return _by_trimesh(library(ending), mesh, ending)
    meshio, values = library(ending), {name: np.ascontiguousarray(field[mesh.stations]) for name, field in fields.items()}
    with tempfile.TemporaryDirectory() as folder:  # meshio writes to files only
        path = Path(folder) / f"strip{ending}"
        meshio.write(path, meshio.Mesh(mesh.vertices, [("quad", mesh.quads)], point_data=values))
        return path.read_bytes()


def _by_trimesh(trimesh, mesh: Mesh, ending: str) -> bytes:
    from trimesh.visual.material import PBRMaterial

    vertices = mesh.vertices
    if ending in (".glb", ".gltf"):  # in glTF the second axis is up
        vertices = vertices[:, [0, 2, 1]] * [1, 1, -1]
    result = trimesh.Trimesh(vertices, mesh.triangles, process=False)
    if ending in (".glb", ".gltf"):
        material = PBRMaterial(baseColorFactor=_COLOUR, metallicFactor=0.0, roughnessFactor=0.6, doubleSided=True)
        result.visual = trimesh.visual.TextureVisuals(material=material)
    if ending == ".gltf":
        files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(result), embed_buffers=True, include_normals=True)
        (data,) = files.values()
    elif ending == ".glb":
        data = trimesh.exchange.gltf.export_glb(trimesh.Scene(result), include_normals=True)
    else:
        data = result.export(file_type=ending[1:])
    return data.encode() if isinstance(data, str) else data
