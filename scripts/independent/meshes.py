"""Shapes as (positions, normals, triangles), and the two files that both renderers read them from."""
import json
import struct

import numpy as np


def polygons(middles, normals, radius, corners):
    """Flat regular polygons."""
    normals = np.asarray(normals, float)
    helper = np.where(np.abs(normals[:, 1:2]) < 0.9, [[0.0, 1, 0]], [[1.0, 0, 0]])
    u = np.cross(helper, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normals, u)
    angle = 2 * np.pi * (np.arange(corners) + 0.5) / corners
    rim = np.cos(angle)[None, :, None] * u[:, None] + np.sin(angle)[None, :, None] * v[:, None]
    positions = np.asarray(middles, float)[:, None] + radius * rim
    fan = np.array([[0, i, i + 1] for i in range(1, corners - 1)])
    triangles = corners * np.arange(len(normals))[:, None, None] + fan[None]
    return positions.reshape(-1, 3), np.repeat(normals, corners, 0), triangles.reshape(-1, 3)


def scattered(count, seed):
    """Points of the unit cube and unit vectors, both random."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    return rng.uniform(size=(count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def kronecker_slab():
    """Leaf area index 3 in 2000 leaves of 0.2 m: the slab of tests/independent.rs."""
    steps = np.array([0.8191725134, 0.6710436067, 0.5497004779, 0.6180339887, 0.7548776662])
    f = np.arange(1, 2001)[:, None] * steps % 1.0
    width = np.sqrt(2000 * 0.04 / 3)
    middles = np.stack([(f[:, 0] - 0.5) * width, 1 + f[:, 1], (f[:, 2] - 0.5) * width], 1)
    y, azimuth = 1 - 2 * f[:, 3], 2 * np.pi * f[:, 4]
    level = np.sqrt(1 - y * y)
    return polygons(middles, np.stack([level * np.cos(azimuth), y, level * np.sin(azimuth)], 1), 0.1 * np.sqrt(2), 4)


def ball():
    """1500 leaves in a ball of radius 1 m around 1.2 m above the origin."""
    points, normals = scattered(6000, 1)
    points = 2 * points - 1
    inside = (points ** 2).sum(1) < 1
    return polygons(points[inside][:1500] + [0, 1.2, 0], normals[inside][:1500], 0.1, 12)


def prism(sides, radius=0.3, height=8.0):
    """A prism with the normals of its cylinder, open at both ends."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], 1)
    i = np.arange(sides)
    j = (i + 1) % sides
    triangles = np.concatenate([np.stack([i, i + sides, j], 1), np.stack([j, i + sides, j + sides], 1)])
    return np.concatenate([ring * radius, ring * radius + [0, height, 0]]), np.concatenate([ring, ring]), triangles


def level_plane(half_sides=(50.0, 500.0, 5e3, 5e4)):
    """Nested squares around the origin: triangles that are not much larger than their distance keep f32 exact."""
    positions, triangles = [], [[0, 1, 2], [0, 2, 3]]
    for half in half_sides:
        positions += [[-half, 0, -half], [-half, 0, half], [half, 0, half], [half, 0, -half]]
    for ring in range(len(half_sides) - 1):
        inner, outer = 4 * ring, 4 * ring + 4
        for i in range(4):
            j = (i + 1) % 4
            triangles += [[inner + i, outer + i, outer + j], [inner + i, outer + j, inner + j]]
    return np.array(positions), np.tile([0.0, 1, 0], (len(positions), 1)), np.array(triangles)


def write_glb(path, mesh, color, foliage, tissue=None):
    """One mesh of one colour for Canopy; its leaves may have layers, with these extras."""
    parts = [(mesh, color, foliage)]
    if foliage:
        # Canopy moves a plant without wood to the origin: a millimetre of wood just under the ground keeps its place.
        corners = np.array([[0, -1e-3, 0], [1e-3, -1e-3, 0], [0, -1e-3, 1e-3]])
        parts.append(((corners, np.tile([0.0, 1, 0], (3, 1)), np.array([[0, 2, 1]])), (0, 0, 0), False))
    binary, views, accessors, meshes, materials = b"", [], [], [], []

    def add(array, kind, component, target):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes, "target": target})
        binary += array.tobytes()
        accessor = {"bufferView": len(views) - 1, "componentType": component, "type": kind, "count": len(array)}
        if kind == "VEC3":
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        accessors.append(accessor)
        return len(accessors) - 1

    for (positions, normals, triangles), base, leaf in parts:
        attributes = {"POSITION": add(np.asarray(positions, "<f4"), "VEC3", 5126, 34962),
                      "NORMAL": add(np.asarray(normals, "<f4"), "VEC3", 5126, 34962)}
        indices = add(np.asarray(triangles, "<u4").reshape(-1), "SCALAR", 5125, 34963)
        name = "leaves" if leaf else "bark"
        materials.append({"name": name, "alphaMode": "MASK" if leaf else "OPAQUE", "doubleSided": True,
                          "pbrMetallicRoughness": {"baseColorFactor": [*map(float, base), 1.0], "metallicFactor": 0.0}})
        if leaf and tissue is not None:
            materials[-1]["extras"] = {"canopy_leaf": tissue}
        meshes.append({"primitives": [{"attributes": attributes, "indices": indices, "material": len(materials) - 1}]})
    nodes = [{"mesh": i, "name": materials[i]["name"]} for i in range(len(meshes))]
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
                "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
                "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary)))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<II", len(binary), 0x004E4942) + binary)


def write_ply(path, mesh, uvs=None):
    """One mesh for Mitsuba, in f64."""
    positions, normals, triangles = (np.asarray(part) for part in mesh)
    columns = {"x": positions[:, 0], "y": positions[:, 1], "z": positions[:, 2],
               "nx": normals[:, 0], "ny": normals[:, 1], "nz": normals[:, 2]}
    if uvs is not None:
        columns |= {"u": uvs[:, 0], "v": uvs[:, 1]}
    vertices = np.zeros(len(positions), dtype=[(name, "<f8") for name in columns])
    for name, values in columns.items():
        vertices[name] = values
    faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(vertices)
    head += "".join("property double %s\n" % name for name in columns)
    head += "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces)
    with open(path, "wb") as file:
        file.write(head.encode() + vertices.tobytes() + faces.tobytes())
