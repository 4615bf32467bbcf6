"""The cases: each yields rows, which are pairs of images of the same scene by both renderers."""
from dataclasses import dataclass

import numpy as np

import canopy
import gloss
import meshes
import other
import tissue
from air import Air, view_directions
from canopy import camera
from foliage import Foliage


@dataclass
class Bench:
    """What a case works with."""
    canopy: canopy.Canopy
    folder: object
    trees: object
    # Factor on the samples.
    effort: float

    def samples(self, count):
        return max(1, round(self.effort * count))


@dataclass
class Row:
    name: str
    # Seeds x height x width x channels.
    canopy: np.ndarray
    other: np.ndarray
    # Whether both render the same model, so that only noise may differ.
    same: bool = True


def green(images):
    return images[..., other.GREEN:other.GREEN + 1]


def lights(mi, bench, which):
    """Request and emitter of a light: `sun 30`, `even`, or `sky 30`."""
    kind, _, elevation = which.partition(" ")
    if kind == "even":
        return {"even": 100.0}, other.even(mi, 100)
    elevation = float(elevation)
    if kind == "sun":
        return ({"sun": {"azimuth": 35, "elevation": elevation, "illuminance": 1000}}, other.sun(mi, 35, elevation, 1000))
    return {"daylight": [35, elevation]}, other.sky(mi, bench.canopy.sky(35, elevation))


def pair(bench, mi, name, request, scene, samples, seeds=8, integrator="path"):
    samples = bench.samples(samples)
    ours = bench.canopy.render(request | {"samples": samples, "seeds": seeds})
    theirs = other.render(mi, scene, request["camera"], samples, seeds, integrator)
    return Row(name, green(ours) if theirs.shape[-1] == 1 else ours, theirs)


def furnace(bench):
    """Leaves that absorb nothing in even light: every pixel is the light."""
    mi = other.variant()
    mesh = meshes.ball()
    meshes.write_glb(bench.folder / "ball.glb", mesh, (0.5,) * 3, True)
    meshes.write_ply(bench.folder / "ball.ply", mesh)
    # At a base colour of 0.5, a matt leaf of Canopy lets the other half through.
    request = {"plants": [canopy.plant(bench.folder / "ball.glb")], "trees": [canopy.tree()], "even": 1.0,
               "camera": camera((0, 1.2, 6), 0, 0, 19, (32, 32))}
    scene = {"light": other.even(mi, 1), "leaves": other.shape(bench.folder / "ball.ply", other.leaf(mi, 0.5, 0.5))}
    yield pair(bench, mi, "1500 leaves, albedo 1, even light", request, scene, 128)


def slab(bench):
    """Leaf area index 3 over ground: the golden numbers of tests/independent.rs."""
    mi = other.variant()
    mesh = meshes.kronecker_slab()
    meshes.write_glb(bench.folder / "slab.glb", mesh, (0.4,) * 3, True)
    meshes.write_ply(bench.folder / "slab.ply", mesh)
    views = {"from above": camera((0, 30, 0), 0, -90, 4, (20, 15)), "aslant": camera((0, 16.5, 25.98), 0, -30, 4, (20, 15)),
             "ground below": camera((0, 0.5, 0), 0, -90, 90, (20, 15))}
    for which in ("sun 60", "sun 30", "sun 10", "even", "sky 60", "sky 10"):
        light, emitter = lights(mi, bench, which)
        for view, eye in views.items():
            request = {"plants": [canopy.plant(bench.folder / "slab.glb")], "trees": [canopy.tree()],
                       "ground": {"albedo": [0.2] * 3, "hills": False}, "camera": eye} | light
            scene = {"light": emitter, "leaves": other.shape(bench.folder / "slab.ply", other.leaf(mi, 0.4, 0.52)),
                     "ground": other.ground(mi, bench.folder, 0.2)}
            yield pair(bench, mi, "slab, %s, %s" % (which, view), request, scene, 256)


def glossy(bench):
    """The same slab with glossy leaves of three colours, against the sun."""
    mi = other.variant(other.COLOR)
    gloss.register(mi)
    color = (0.05, 0.2, 0.43)
    mesh = meshes.kronecker_slab()
    meshes.write_glb(bench.folder / "glossy.glb", mesh, color, True)
    meshes.write_ply(bench.folder / "glossy.ply", mesh)
    eye = other.to_sun(215, 20)
    eye = camera(30 * eye + [0, 1.5, 0], np.degrees(np.arctan2(eye[0], eye[2])), -20, 4, (20, 15))
    for share, width in ((0.045, 0.4), (0.09, 0.2)):
        for which in ("sun 30", "even"):
            light, emitter = lights(mi, bench, which)
            request = {"plants": [canopy.plant(bench.folder / "glossy.glb", (share, width))], "trees": [canopy.tree()],
                       "ground": {"albedo": [0.2] * 3, "hills": False}, "camera": eye} | light
            scene = {"light": emitter, "ground": other.ground(mi, bench.folder, 0.2),
                     "leaves": other.shape(bench.folder / "glossy.ply", gloss.bsdf(color, share, width))}
            yield pair(bench, mi, "glossy leaves %g, %g, %s" % (share, width, which), request, scene, 128)


def hills(bench):
    """Canopy's smooth ground against triangles of a metre."""
    mi = other.variant()
    heights = bench.canopy.heights()
    n = len(heights)
    x, z = np.meshgrid(*2 * [(np.arange(n) / (n - 1) - 0.5) * 640])
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None]).reshape(-1)
    triangles = np.concatenate([np.stack([corner, corner + n, corner + 1], 1), np.stack([corner + 1, corner + n, corner + n + 1], 1)])
    positions = np.stack([x, heights, z], -1).reshape(-1, 3)
    meshes.write_ply(bench.folder / "hills.ply", (positions, np.zeros_like(positions), triangles))
    ground = other.loaded(mi, {"hills": other.shape(bench.folder / "hills.ply", other.matt(mi, 0.3))})
    for which in ("sun 30", "sun 10", "sun 4", "sky 30", "sky 4"):
        light, emitter = lights(mi, bench, which)
        request = {"ground": {"albedo": [0.3] * 3, "hills": True}, "camera": camera((0, 180, 100), 0, -45, 40)} | light
        scene = {"light": emitter} | ground
        yield pair(bench, mi, "hills, %s" % which, request, scene, 64)


def trees(bench):
    """Trees with alpha-tested leaves and textured bark on level ground."""
    mi = other.variant()
    views = {"oak-medium": {"crown": camera((4, 18, 62), 4, -3, 8), "trunk": camera((2, 1.5, 7), 16, 0, 5),
                            "shadow": camera((-6, 50, 8), 0, -80, 12)},
             "aspen-medium": {"crown": camera((4, 14, 40), 5, -3, 8), "trunk": camera((2, 1.5, 7), 16, 0, 3),
                              "shadow": camera((-4, 40, 6), 0, -80, 12)}}
    for name, eyes in views.items():
        file = bench.trees / (name + ".glb")
        shapes = other.loaded(mi, Foliage(file).shapes(mi, bench.folder))
        for which in ("sun 50", "sky 50"):
            light, emitter = lights(mi, bench, which)
            for view, eye in eyes.items():
                request = {"plants": [canopy.plant(file)], "trees": [canopy.tree()], "camera": eye,
                           "ground": {"albedo": [0.15] * 3, "hills": False}} | light
                scene = {"light": emitter, "ground": other.ground(mi, bench.folder, 0.15)} | shapes
                # Transparent texels let light of a directional emitter through in the volumetric integrator alone.
                yield pair(bench, mi, "%s, %s, %s" % (name, which, view), request, scene, 64, integrator="volpath")


def several(bench):
    """Three trees of two plants, rotated, scaled, tinted, in each other's shade."""
    mi = other.variant()
    files = [bench.trees / (name + ".glb") for name in ("oak-medium", "aspen-medium")]
    models = [Foliage(file) for file in files]
    stand = [canopy.tree(0, (0, 0, 0), 40, 0.8, 0.7), canopy.tree(1, (6, 0, -5), 200, 1.2, -0.5), canopy.tree(0, (-7, 0, 4), 300, 1.1, 0.2)]
    shapes = {}
    for tree in stand:
        place = {key: tree[key] for key in ("position", "yaw", "scale", "tint")}
        shapes |= models[tree["plant"]].shapes(mi, bench.folder, **place)
    shapes = other.loaded(mi, shapes | {"ground": other.ground(mi, bench.folder, 0.15)})
    for which in ("sun 40", "sky 40"):
        light, emitter = lights(mi, bench, which)
        scene = {"light": emitter} | shapes
        for view, eye in {"crowns": camera((0, 14, 60), 0, -3, 12), "from above": camera((0, 80, 0), 0, -90, 14)}.items():
            request = {"plants": [canopy.plant(file) for file in files], "trees": stand, "camera": eye,
                       "ground": {"albedo": [0.15] * 3, "hills": False}} | light
            yield pair(bench, mi, "three trees, %s, %s" % (which, view), request, scene, 64, integrator="volpath")


def fog(bench):
    """The slab behind air: the formula of src/reference/fog.rs on each of Mitsuba's samples and its distance."""
    mi = other.variant()
    mesh = meshes.kronecker_slab()
    meshes.write_glb(bench.folder / "slab.glb", mesh, (0.4,) * 3, True)
    meshes.write_ply(bench.folder / "slab.ply", mesh)
    air = Air(bench.canopy.sky(35, 30), bench.canopy.light(35, 30))
    light, emitter = lights(mi, bench, "sky 30")
    scene = other.loaded(mi, {"light": emitter, "ground": other.ground(mi, bench.folder, 0.2),
                              "leaves": other.shape(bench.folder / "slab.ply", other.leaf(mi, 0.4, 0.52))})
    views = {"60 m": camera((0, 8, 60), 0, -6, 3), "2 km": camera((0, 300, 2000), 0, -8.5, 0.1),
             "8 km": camera((0, 300, 8000), 0, -2.14, 0.03)}
    for name, eye in views.items():
        request = {"plants": [canopy.plant(bench.folder / "slab.glb")], "trees": [canopy.tree()], "fog": True, "camera": eye,
                   "ground": {"albedo": [0.2] * 3, "hills": False}, "samples": bench.samples(100), "seeds": 8} | light
        # Air acts on each sample by its own distance, so Mitsuba has one sample a pixel of a finer image.
        fine = eye | {"width": 10 * eye["width"], "height": 10 * eye["height"]}
        theirs = []
        for seed in range(1, 9):
            seen, distance = other.radiance_and_distance(mi, scene, fine, seed)
            theirs.append(air.over(seen, distance, view_directions(fine), eye["position"][1]))
        yield Row("slab in fog, %s away" % name, green(bench.canopy.render(request)), np.stack(theirs)[..., None])


def layers(bench):
    """A leaf with layers over the angle of the light, against slabs of the same tissue in Mitsuba. Canopy keeps polynomials."""
    mi = other.variant()
    leaf = meshes.polygons([[0, 0, 0]], [[0.0, 1, 0]], 0.5, 4)
    for scattering in (1.0, 4.0):
        extras = {"maxThickness": 0.0004, "absorptionRange": [2500, 2500], "scattering": scattering}
        meshes.write_glb(bench.folder / "layers.glb", leaf, (0.2,) * 3, True, extras)
        slabs = tissue.slabs(mi, 0.5, scattering)
        for what, pitch in (("sent back", -90), ("let through", 90)):
            def ours(degrees):
                request = {"plants": [canopy.plant(bench.folder / "layers.glb")], "trees": [canopy.tree()], "samples": 64, "seeds": 8,
                           "camera": camera((0, -pitch / 9, 0), 0, pitch, 0.1, (4, 4)),
                           "sun": {"azimuth": 35, "elevation": 90 - degrees, "illuminance": 1000}}
                return green(bench.canopy.render(request)).mean((1, 2, 3), keepdims=True) / np.cos(np.radians(degrees))

            def theirs(degrees):
                sent = tissue.sent(mi, slabs, degrees, what == "sent back", bench.samples(512), 8)
                return sent.mean((1, 2, 3), keepdims=True)

            whole = ours(0).mean(), theirs(0).mean()
            for degrees in (45, 60, 75):
                name = "light at %d° %s by a leaf, scattering %g" % (degrees, what, scattering)
                yield Row(name, ours(degrees) / whole[0], theirs(degrees) / whole[1], same=False)


def prisms(bench):
    """Wood with interpolated normals against the cylinder that it stands for. The models differ: the row tells by how much."""
    mi = other.variant()
    whole = camera((0, 4, 120), 0, 0, 0.36, (40, 40))
    meshes_of = {sides: meshes.prism(sides) for sides in (6, 8, 12, 24)}
    # Mitsuba's own cylinder shades itself where the camera is far: a prism of 720 flat sides stands for it.
    meshes.write_ply(bench.folder / "cylinder.ply", meshes.prism(720))
    cylinder = other.shape(bench.folder / "cylinder.ply", other.matt(mi, 1))
    for azimuth in (180, 130, 90):
        emitter = other.sun(mi, azimuth, 20, 1000)
        sun = {"sun": {"azimuth": azimuth, "elevation": 20, "illuminance": 1000}}
        theirs = other.render(mi, {"light": emitter, "cylinder": cylinder}, whole, bench.samples(64), 8)
        for sides, mesh in meshes_of.items():
            file = bench.folder / ("prism%d.glb" % sides)
            meshes.write_glb(file, mesh, (1, 1, 1), False)
            # A trunk has any rotation: the mean of eight.
            turned = []
            for turn in range(8):
                tree = canopy.tree(0, (0, 0, 0), 360 / sides * (turn + 0.5) / 8)
                request = {"plants": [canopy.plant(file)], "trees": [tree], "camera": whole, "round_wood": True, "samples": bench.samples(32)}
                turned.append(bench.canopy.render(request | sun)[0])
            # A prism is a little narrower than its cylinder, by sin(x)/x in the mean.
            narrower = np.sinc(1 / sides)
            name = "prism of %d sides for a cylinder, sun %d° from the view" % (sides, 180 - azimuth)
            yield Row(name, green(np.stack(turned)) / narrower, theirs, same=False)


# Those with a name here need trees.
CASES = {case.__name__: case for case in (furnace, slab, glossy, hills, trees, several, fog, layers, prisms)}
NEED_TREES = {"trees", "several"}
