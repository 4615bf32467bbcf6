"""Canopy's glossy leaf as a BSDF of Mitsuba, from the formulas of src/plant/gloss.rs and src/reference/lobe.rs."""
import numpy as np


def parts(color, share, width, transmission=1.3):
    """Diffusely reflected, transmitted, and the strength of the lobe, channel by channel."""
    color = np.asarray(color, float)
    inside = np.sqrt(color ** 2 + share ** 2) - share
    through = np.clip(transmission * inside, 0, 1 - color)
    gain = ((0.74735 * width - 0.46445) * width + 2.97115) * width + 1.03146
    peak = 1.004 / ((((0.61461 * width - 1.46804) * width + 0.63987) * width + 1.11631) * width + 0.097622)
    specular = np.minimum(color - inside, (1 - color - through) / (gain * peak - 1))
    return color - specular, through, specular * gain


def register(mi):
    import drjit as dr

    class GlossyLeaf(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            channels = [[float(props.get(part + channel)) for channel in "rgb"] for part in ("diffuse", "through", "lobe")]
            self.diffuse, self.through, self.lobe = (mi.Color3f(*values) for values in channels)
            self.width = float(props.get("width"))
            back, front = sum(channels[1]), sum(channels[0]) + sum(channels[2]) / 3
            self.reflecting = float(np.clip(front / (front + back), 0.1, 1.0))
            both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [mi.BSDFFlags.DiffuseReflection | both, mi.BSDFFlags.DiffuseTransmission | both]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def value(self, wi, wo):
            ci, co = mi.Frame3f.cos_theta(wi), mi.Frame3f.cos_theta(wo)
            nv, nl, w = dr.abs(ci), dr.abs(co), self.width
            lm = dr.sqrt(dr.maximum(0.5 * (1 + dr.dot(wi, wo)), 0))
            nm = dr.minimum((nv + nl) / dr.maximum(2 * lm, 1e-6), 1)
            fresnel = 0.5 + 10.5 * (1 - lm) ** 5
            distribution = w * w * dr.inv_pi / dr.square(nm * nm * (w * w - 1) + 1)
            masking = 0.5 / dr.maximum(2 * nl * nv * (1 - w) + (nl + nv) * w, 1e-20)
            reflected = self.diffuse * dr.inv_pi + self.lobe * (fresnel * distribution * masking)
            return dr.select(ci * co > 0, reflected, self.through * dr.inv_pi) * nl

        def density(self, wi, wo):
            ci, co = mi.Frame3f.cos_theta(wi), mi.Frame3f.cos_theta(wo)
            return dr.select(ci * co > 0, self.reflecting, 1 - self.reflecting) * dr.abs(co) * dr.inv_pi

        def sample(self, ctx, si, sample1, sample2, active=True):
            reflect = sample1 < self.reflecting
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            wo.z = dr.select((mi.Frame3f.cos_theta(si.wi) > 0) != reflect, -wo.z, wo.z)
            bs = mi.BSDFSample3f()
            bs.wo, bs.pdf, bs.eta = wo, self.density(si.wi, wo), 1.0
            kinds = [mi.UInt32(+flags) for flags in (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.DiffuseTransmission)]
            bs.sampled_type = dr.select(reflect, *kinds)
            bs.sampled_component = dr.select(reflect, mi.UInt32(0), mi.UInt32(1))
            weight = self.value(si.wi, wo) / dr.maximum(bs.pdf, 1e-20)
            return bs, dr.select(active & (bs.pdf > 0), weight, 0)

        def eval(self, ctx, si, wo, active=True):
            return dr.select(active, self.value(si.wi, wo), 0)

        def pdf(self, ctx, si, wo, active=True):
            return dr.select(active, self.density(si.wi, wo), 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return "GlossyLeaf[]"

    mi.register_bsdf("glossyleaf", GlossyLeaf)


def bsdf(color, share, width):
    out = {"type": "glossyleaf", "width": float(width)}
    for name, values in zip(("diffuse", "through", "lobe"), parts(color, share, width)):
        out |= {name + channel: float(value) for channel, value in zip("rgb", values)}
    return out
