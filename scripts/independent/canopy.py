"""Canopy's side: requests to examples/probe.rs."""
import json
import subprocess
from pathlib import Path

import numpy as np

SKY_WIDTH = 2048


class Canopy:
    def __init__(self, program):
        self.program = str(program)

    def answer(self, command, request):
        done = subprocess.run([self.program, command], input=json.dumps(request).encode(), capture_output=True)
        if done.returncode:
            raise SystemExit("the probe failed: %s\n%s" % (done.stderr.decode().strip(), json.dumps(request)))
        return done.stdout

    def render(self, request):
        """Radiance: seeds x height x width x 3."""
        camera = request["camera"]
        pixels = np.frombuffer(self.answer("render", request), "<f4").astype(float)
        return pixels.reshape(-1, camera["height"], camera["width"], 3)

    def sky(self, azimuth, elevation):
        """The sky as an image of radiance, row 0 at the zenith."""
        pixels = np.frombuffer(self.answer("sky", {"daylight": [azimuth, elevation]}), "<f4")
        return pixels.reshape(-1, SKY_WIDTH, 3)

    def light(self, azimuth, elevation):
        """The sun and the fog that belong to the sky."""
        return json.loads(self.answer("light", {"daylight": [azimuth, elevation]}))

    def heights(self):
        """Heights of the hills over 640 m."""
        heights = np.frombuffer(self.answer("heights", {}), "<f8")
        side = int(round(np.sqrt(heights.size)))
        return heights.reshape(side, side)


def camera(position, yaw, pitch, field_of_view, size=(40, 30)):
    """Angles in degrees; yaw counter-clockwise seen from above, 0 looks north, to -Z."""
    return {"position": [float(v) for v in position], "yaw": float(yaw), "pitch": float(pitch),
            "field_of_view": float(field_of_view), "width": size[0], "height": size[1]}


def tree(plant=0, position=(0, 0, 0), yaw=0.0, scale=1.0, tint=0.0):
    return {"plant": plant, "position": list(map(float, position)), "yaw": yaw, "scale": scale, "tint": tint}


def plant(file, gloss=(0.0, 0.4)):
    return {"file": str(Path(file).resolve()), "gloss": list(gloss)}
