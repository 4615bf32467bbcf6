"""Three slabs of tissue that absorb and scatter, as Mitsuba has them: four smooth interfaces with media between them."""
import numpy as np

# As LeafTissue has them.
SHARES, INDICES = (0.45, 0.4, 0.15), (1.33, 1.0, 1.33)
DISTANCE = 50.0


def mirrored(cosine, index):
    """Fresnel's reflectance of an interface to air."""
    inside = np.sqrt(1 - (1 - cosine ** 2) / index ** 2)
    across = (cosine - index * inside) / (cosine + index * inside)
    along = (index * cosine - inside) / (index * cosine + inside)
    return 0.5 * (across ** 2 + along ** 2)


def slabs(mi, absorption, scattering):
    """A leaf of thickness 1 below the plane y = 0, wider than light walks."""
    extinction = absorption + scattering
    medium = {"type": "homogeneous", "sigma_t": {"type": "uniform", "value": extinction},
              "albedo": {"type": "uniform", "value": scattering / extinction}, "phase": {"type": "isotropic"}}
    media = [None] + [mi.load_dict(medium) for _ in SHARES] + [None]
    indices = (1.0, *INDICES, 1.0)
    shapes, height = {}, 0.0
    for plane in range(4):
        place = mi.ScalarTransform4f().translate([0, height, 0]).rotate([1, 0, 0], -90).scale(1e3)
        shape = {"type": "rectangle", "to_world": place}
        if indices[plane] == indices[plane + 1]:
            shape["bsdf"] = {"type": "null"}
        else:
            shape["bsdf"] = {"type": "dielectric", "ext_ior": indices[plane], "int_ior": indices[plane + 1]}
        for side, inside in (("exterior", media[plane]), ("interior", media[plane + 1])):
            if inside is not None:
                shape[side] = inside
        shapes["plane%d" % plane] = shape
        height -= SHARES[plane] if plane < 3 else 0.0
    return shapes


def sent(mi, shapes, degrees, from_above, samples, seeds):
    """Fraction of the light of one direction that has entered the leaf from above and comes out above, or below. By
    reciprocity it is the radiance towards that direction under the bright upper, or lower, half of a sky, less what
    the surface mirrors."""
    image = np.zeros((512, 1024, 1), np.float32)
    image[:256 if from_above else 512] = 1.0
    image[:0 if from_above else 256] = 0.0
    angle = np.radians(degrees)
    toward = np.array([np.sin(angle), np.cos(angle), 0])
    look = mi.ScalarTransform4f().look_at(origin=(DISTANCE * toward).tolist(), target=[0, 0, 0], up=[0, 0, 1])
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}, "pixel_format": "luminance",
            "component_format": "float32"}
    scene = mi.load_dict(shapes | {
        "type": "scene", "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 64},
        "light": {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(image))},
        "sensor": {"type": "perspective", "fov": 0.01, "near_clip": 1e-3, "far_clip": 1e7, "to_world": look, "film": film,
                   "sampler": {"type": "independent"}}})
    images = [np.array(mi.render(scene, spp=samples, seed=1000 * seed), float) for seed in range(1, seeds + 1)]
    light = np.stack(images).reshape(seeds, 4, 4, 1)
    mirror = mirrored(np.cos(angle), INDICES[0])
    return (light - (mirror if from_above else 0.0)) / (1 - mirror)
