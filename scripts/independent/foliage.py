"""A tree of a GLB file as Mitsuba has it, read independently of Canopy."""
import io

import numpy as np
import pygltflib
from PIL import Image

import meshes
import other

# Texels of the alpha test to each of the texture's, along an axis.
FINER = 4


def linear(code):
    code = code / 255.0
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def accessor(document, blob, index):
    it = document.accessors[index]
    view = document.bufferViews[it.bufferView]
    kind = np.dtype({5126: "<f4", 5125: "<u4", 5123: "<u2"}[it.componentType])
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[it.type]
    start, packed = (view.byteOffset or 0) + (it.byteOffset or 0), width * kind.itemsize
    stride = view.byteStride or packed
    raw = np.frombuffer(blob, "u1", stride * (it.count - 1) + packed, start)
    rows = np.lib.stride_tricks.as_strided(raw, (it.count, packed), (stride, 1))
    return np.ascontiguousarray(rows).view(kind)


def upsampled(values):
    """Bilinear between texel centres, repeating."""
    for axis in (0, 1):
        size = values.shape[axis]
        at = (np.arange(size * FINER) + 0.5) / FINER - 0.5
        low = np.floor(at).astype(int)
        part = (at - low).reshape([-1 if i == axis else 1 for i in range(values.ndim)])
        values = np.take(values, low % size, axis) * (1 - part) + np.take(values, (low + 1) % size, axis) * part
    return values


class Foliage:
    """Parts of a tree: wood and leaves."""

    def __init__(self, file):
        document = pygltflib.GLTF2().load(str(file))
        blob = document.binary_blob()
        self.name, self.parts = file.stem, []
        for node in document.nodes:
            if node.mesh is None:
                continue
            for primitive in document.meshes[node.mesh].primitives:
                material = document.materials[primitive.material]
                pbr = material.pbrMetallicRoughness
                image = document.images[document.textures[pbr.baseColorTexture.index].source]
                view = document.bufferViews[image.bufferView]
                data = blob[view.byteOffset:view.byteOffset + view.byteLength]
                texels = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA")).astype(np.float32)
                attributes = primitive.attributes
                self.parts.append(self.part(
                    material.alphaMode == "MASK", material.alphaCutoff or 0.5, np.array((pbr.baseColorFactor or [1, 1, 1])[:3]), texels,
                    [accessor(document, blob, i).astype(float) for i in (attributes.POSITION, attributes.NORMAL, attributes.TEXCOORD_0)],
                    accessor(document, blob, primitive.indices).reshape(-1, 3).astype(int)))
        self.height = max(part["mesh"][0][:, 1].max() for part in self.parts)

    @staticmethod
    def part(leaves, cutoff, factor, texels, attributes, triangles):
        positions, normals, uvs = attributes
        part = {"leaves": leaves, "mesh": (positions, normals, triangles), "uvs": uvs}
        reflectance = linear(texels[..., :3])
        if leaves:
            # The alpha test is on the bilinear alpha, between texels too. Colours are weighted by alpha.
            alpha = texels[..., 3:] / 255
            finer = upsampled(alpha)
            reflectance = np.where(finer > 0, upsampled(reflectance * alpha) / np.maximum(finer, 1e-9), 1.0)
            part["opacity"] = finer >= cutoff - 1e-7
        part["reflectance"] = reflectance * factor
        return part

    def shapes(self, mi, folder, position=(0, 0, 0), yaw=0.0, scale=1.0, tint=0.0, round_wood=False):
        """The tree as one instance of it stands."""
        sine, cosine = np.sin(np.radians(yaw)), np.cos(np.radians(yaw))
        turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        green = slice(other.GREEN, other.GREEN + 1) if "mono" in mi.variant() else slice(3)
        out = {}
        for index, part in enumerate(self.parts):
            positions, normals, triangles = part["mesh"]
            key = "%s_%d_%d_%d" % (self.name.replace("-", "_"), index, round(1e3 * position[0]), round(1e3 * position[2]))
            path = folder / (key + ".ply")
            placed = scale * positions @ turn.T + np.asarray(position, float)
            meshes.write_ply(path, (placed, normals @ turn.T, triangles), part["uvs"])
            reflectance = part["reflectance"]
            if part["leaves"]:
                reflectance = reflectance * (1 + tint * np.array([0.18, 0.07, -0.05]))
                transmittance = np.clip(1.3 * part["reflectance"], 0, 1 - part["reflectance"]) * (reflectance / np.maximum(part["reflectance"], 1e-9))
                over = np.maximum(reflectance + transmittance, 1)
                textures = [other.bitmap(mi, (values / over)[..., green], filter_type="nearest") for values in (reflectance, transmittance)]
                inner = {"type": "bilambertian", "reflectance": textures[0], "transmittance": textures[1]}
                opacity = other.bitmap(mi, part["opacity"], filter_type="nearest")
                bsdf = {"type": "mask", "opacity": opacity, "nested": inner}
            else:
                bark = other.bitmap(mi, reflectance[..., green], filter_type="bilinear")
                bsdf = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": bark}}
            out[key] = other.shape(path, bsdf, flat=part["leaves"] or not round_wood) | {"flip_tex_coords": False}
        return out
