"""Mitsuba's side: dictionaries of scenes. Green alone, in f64 (`scalar_mono_double`), unless a case says otherwise."""
import numpy as np

import meshes

MONO = "scalar_mono_double"
# A custom BSDF needs a vectorised variant; its f32 moves rays 1e-4 m off a surface.
COLOR = "llvm_ad_rgb"
GREEN = 1


def variant(name=MONO):
    import mitsuba
    mitsuba.set_variant(name)
    return mitsuba


def color(mi, value):
    """One number, or three of which a mono variant takes the green one."""
    value = np.broadcast_to(np.asarray(value, float), 3)
    if "mono" in mi.variant():
        return {"type": "uniform", "value": float(value[GREEN])}
    return {"type": "rgb", "value": value.tolist()}


def bitmap(mi, values, **more):
    values = np.ascontiguousarray(np.asarray(values, np.float32))
    return {"type": "bitmap", "bitmap": mi.Bitmap(values), "raw": True} | more


def sensor(mi, camera):
    """The same camera as the probe's."""
    a, b = np.radians(camera["yaw"]), np.radians(camera["pitch"])
    forward = np.array([-np.sin(a) * np.cos(b), np.sin(b), -np.cos(a) * np.cos(b)])
    up = [np.sin(a) * np.sin(b), np.cos(b), np.cos(a) * np.sin(b)]
    origin = np.array(camera["position"])
    look = mi.ScalarTransform4f().look_at(origin=origin.tolist(), target=(origin + forward).tolist(), up=up)
    film = {"type": "hdrfilm", "width": camera["width"], "height": camera["height"], "rfilter": {"type": "box"},
            "pixel_format": "luminance" if "mono" in mi.variant() else "rgb", "component_format": "float32"}
    return {"type": "perspective", "fov": camera["field_of_view"], "fov_axis": "y", "near_clip": 1e-3, "far_clip": 1e7,
            "to_world": look, "film": film, "sampler": {"type": "independent"}}


def leaf(mi, reflectance, transmittance):
    return {"type": "bilambertian", "reflectance": color(mi, reflectance), "transmittance": color(mi, transmittance)}


def matt(mi, albedo):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color(mi, albedo)}}


def shape(path, bsdf, flat=True):
    return {"type": "ply", "filename": str(path), "face_normals": flat, "bsdf": bsdf}


def loaded(mi, shapes):
    """Shapes as objects, so that several scenes share them."""
    return {name: mi.load_dict(shape) for name, shape in shapes.items()}


def ground(mi, folder, albedo):
    path = folder / "ground.ply"
    meshes.write_ply(path, meshes.level_plane())
    return shape(path, matt(mi, albedo))


def to_sun(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.sin(a), np.sin(e), -np.cos(e) * np.cos(a)])


def sun(mi, azimuth, elevation, illuminance):
    return {"type": "directional", "direction": (-to_sun(azimuth, elevation)).tolist(), "irradiance": color(mi, illuminance)}


def even(mi, radiance):
    return {"type": "constant", "radiance": color(mi, radiance)}


def sky(mi, image):
    image = image[..., GREEN:GREEN + 1] if "mono" in mi.variant() else image
    return {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(image))}


def render(mi, scene, camera, samples, seeds, integrator="path"):
    """Radiance: seeds x height x width x channels."""
    whole = {"type": "scene", "integrator": {"type": integrator, "max_depth": -1, "rr_depth": 8},
             "sensor": sensor(mi, camera)}
    loaded = mi.load_dict(whole | scene)
    images = [np.array(mi.render(loaded, spp=samples, seed=1000 * seed), float) for seed in range(1, seeds + 1)]
    return np.stack(images).reshape(seeds, camera["height"], camera["width"], -1)


def radiance_and_distance(mi, scene, camera, seed):
    """One sample a pixel: its radiance, and the metres to what it shows, 0 for the sky."""
    inner = {"type": "path", "max_depth": -1, "rr_depth": 8}
    whole = {"type": "scene", "integrator": {"type": "aov", "aovs": "distance:depth", "inner": inner},
             "sensor": sensor(mi, camera)}
    image = np.array(mi.render(mi.load_dict(whole | scene), spp=1, seed=seed), float)
    return image[..., 0], image[..., -1]
