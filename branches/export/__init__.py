"""Results as files for other programs and as films."""

#: The library that writes each format of surfaces, by the ending of the file's name.
LIBRARIES = {".stl": "trimesh", ".obj": "trimesh", ".glb": "trimesh", ".gltf": "trimesh", ".vtk": "meshio", ".vtu": "meshio"}
