"""The fog of src/reference/fog.rs, written again from its page, for one channel."""
import numpy as np

import other


def view_directions(camera):
    """Unit vectors through the middles of the pixels, for a camera without yaw."""
    width, height = camera["width"], camera["height"]
    tangent, pitch = np.tan(np.radians(camera["field_of_view"]) / 2), np.radians(camera["pitch"])
    column, row = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    x, up, ahead = (2 * column - 1) * tangent * width / height, (1 - 2 * row) * tangent, 1.0
    y, z = np.cos(pitch) * up + np.sin(pitch) * ahead, np.sin(pitch) * up - np.cos(pitch) * ahead
    length = np.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


class Air:
    def __init__(self, sky, terms):
        """Canopy's sky as an image, and the terms of its light."""
        self.sky = sky[..., other.GREEN].astype(float)
        self.extinction, self.scale_height = terms["extinction"][other.GREEN], terms["scale_height"]
        self.harmonics = np.array(terms["sky_harmonics"])[:, other.GREEN]

    def white(self, x, y, z):
        """Radiance that a white surface of this normal returns of the sky [Ramamoorthi & Hanrahan 2001, eq. 8]."""
        a, b, c, d, e = 0.28209479, 0.48860251, 1.09254843, 0.31539157, 0.54627422
        basis = [a, -b * x, b * y, -b * z, c * z * x, -c * x * y, d * (3 * y * y - 1), -c * z * y, e * (z * z - x * x)]
        return sum(h * f * v for h, f, v in zip(self.harmonics, [1] + 3 * [2 / 3] + 5 * [1 / 4], basis))

    def radiance(self, x, y, z):
        """The sky, bilinear."""
        height, width = self.sky.shape
        row = np.arccos(np.clip(y, -1, 1)) / np.pi * (height - 1)
        column = (np.arctan2(x, -z) / (2 * np.pi)) % 1 * width - 0.5
        r, c = np.clip(row.astype(int), 0, height - 2), np.floor(column).astype(int)
        p, q = row - r, column - c
        left, right = c % width, (c + 1) % width
        upper = (1 - q) * self.sky[r, left] + q * self.sky[r, right]
        lower = (1 - q) * self.sky[r + 1, left] + q * self.sky[r + 1, right]
        return (1 - p) * upper + p * lower

    def over(self, radiance, distance, direction, height):
        """What arrives at a camera at this height; a distance of 0 is the sky, which has its air already."""
        x, y, z = direction

        def raised(least):
            lifted = np.maximum(y, least)
            length = np.sqrt(x * x + lifted * lifted + z * z)
            return x / length, lifted / length, z / length

        rise = np.clip(y * distance / self.scale_height, -20, 20)
        mean_density = np.where(np.abs(rise) < 1e-3, 1 - 0.5 * rise, -np.expm1(-rise) / np.where(rise == 0, 1, rise))
        depth = self.extinction * distance * np.exp(-height / self.scale_height) * np.minimum(mean_density, 50)
        clear = np.exp(-depth)
        mean = self.white(*raised(0.4))
        rim = np.minimum(self.radiance(*raised(0.03)), 6 * mean)
        air = mean + (rim - mean) * (1 - clear) ** 2
        return np.where(distance > 0, radiance * clear + air * (1 - clear), radiance)
