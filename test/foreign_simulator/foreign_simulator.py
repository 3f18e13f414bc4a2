#!/usr/bin/env python3
"""Another simulator's logs of everyday conditions: a robot of config/ in MuJoCo, and what the product says of them.

Kinematics, drawing, light, noise, lens and motion are MuJoCo's or this file's; nothing is shared with
bodyschema-sim, so that what the product gets right before both is not what one simulator happens to draw.

usage: foreign_simulator.py play ROBOT CONDITION SEED FOLDER       a log with its truth, and a picture of it
       foreign_simulator.py check ROBOT FOLDER                     kinematics and outlines against the product's own
       foreign_simulator.py diagnose FOLDER [--robots ...] [--faults ...] [--seeds ...]
       foreign_simulator.py table FOLDER [--robots ...] [--conditions ...] [--seeds ...] [--set KEY=VALUE ...]
ROBOT is a folder of config/ (icub_right, icub_v2_5), CONDITION one of CONDITIONS below, or a FAULT.

`table` plays what is not in FOLDER yet, runs `bodyschema replay` on it with the robot's configuration and
vision.method=auto, and prints for each row, of the frames from the 45th on with the hand in view: the
hand's error (in the left camera's frame) over converged frames (over the last fifty where none is), the share that
is `converged`, and how many of these are wrong: the hand off by more than 3 published standard deviations and 2 mm,
or an offset by more than 5. Wrong by the rules of `bodyschema evaluate everyday`; exit status 1 where any is.

Needs Python with mujoco, lcm, numpy, opencv-python-headless, trimesh, pycollada, pyyaml (BODYSCHEMA_MUJOCO: the virtual
environment that has them; without it, exit status 77), and lcm-gen.
MUJOCO_GL=osmesa or egl chooses what draws; a log of 30 s takes about a minute on one core.
"""
import argparse
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

os.environ.setdefault("MUJOCO_GL", "osmesa")
SKIPPED = 77
environment = pathlib.Path(os.environ.get("BODYSCHEMA_MUJOCO", sys.prefix))
if environment.resolve() != pathlib.Path(sys.prefix).resolve():
    python = str(environment / "bin/python3")
    os.execv(python, [python, *sys.argv])
try:
    import collada  # noqa: F401, what trimesh reads .dae with
    import cv2
    import lcm
    import mujoco
    import numpy as np
    import trimesh
    import yaml
except ImportError as missing:
    print(f"skipped: {missing}; pip install mujoco lcm numpy opencv-python-headless trimesh pycollada pyyaml, and set "
          "BODYSCHEMA_MUJOCO to the environment it is in")
    sys.exit(SKIPPED)

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PICTURES_HZ, ENCODERS_HZ = 10, 100
FINER = 3  # samples per pixel along each axis
FIRST_COUNTED = 45  # frames; time to converge
DIGITS = "r_(hand_)?(thumb|index|middle|ring|little)"
START_US = 1_700_000_000_000_000
DEG = math.pi / 180

PLAIN = {"room": "wall", "wall": [0.36, 0.50, 0.44], "head": "still", "looks": "grey", "seconds": 30, "hz": PICTURES_HZ,
         "rest": 1.0}
CONDITIONS = {
    "plain": {},
    "room": {"room": "kitchen"},
    "head": {"room": "kitchen", "head": "gaze"},
    "covers": {"room": "kitchen", "looks": "covers"},
    "skin": {"room": "kitchen", "looks": "skin"},
    "light": {"room": "kitchen", "drift": 0.3, "flicker": 0.04},
    "object": {"room": "kitchen", "box": True},
    "person": {"room": "kitchen", "person": True},
    "second_arm": {"room": "kitchen", "second_arm": True},
    "pale": {"looks": "covers", "wall": [0.8, 0.8, 0.78]},  # white on white
    "white": {"looks": "white", "wall": [0.8, 0.8, 0.78]},
    "grey": {"wall": [0.45, 0.45, 0.46]},
    "dim": {"room": "kitchen", "light": 0.3, "noise": 2.0},
    "lens": {"k1": -0.3},
    "jpeg": {"room": "kitchen", "jpeg": 70},
    "all": {"room": "kitchen", "head": "gaze", "looks": "covers", "drift": 0.2, "flicker": 0.02, "box": True,
            "person": True, "k1": -0.3, "jpeg": 70},
    # What laboratories have besides.
    "exposure": {"room": "kitchen", "head": "gaze", "auto_exposure": True},  # each camera sets its own
    "mirror": {"room": "kitchen", "reflectance": 0.45},  # a polished table
    "sun": {"wall": [0.62, 0.61, 0.58], "near_wall": True, "sun": True},  # the arm's hard shadow on a wall close behind
    "twin": {"wall": "twin"},  # pieces of the wall have the robot's own grays
    "door": {"looks": "skin", "wall": "door"},  # half the wall has the hand's colour
    "left_arm": {"room": "kitchen", "left_arm": True},  # the robot's own other arm, of the same make, at work too
    "turns": {"room": "kitchen", "box": True, "turns": True},  # a box taken and laid down again
    "tray": {"room": "kitchen", "box": [0.1, 0.012, 0.075]},  # larger than the hand
    "enters": {"room": "kitchen", "away": [(0, 10), (17, 22)]},  # the arm comes after 10 s, and leaves for 5 s
    "slow": {"room": "kitchen", "hz": 2, "seconds": 60},
    "pauses": {"room": "kitchen", "rest": 10, "hz": 5, "seconds": 60},
    "unfocused": {"room": "kitchen", "blur": 1.5},
    "haze": {"room": "kitchen", "haze": 0.45, "gamma": 0.6},
    "worn": {"room": "kitchen", "worn": True},  # a dark rim, a pattern that stands, dead pixels
    "interlaced": {"room": "kitchen", "interlaced_ms": 20},
    "unsynchronised": {"room": "kitchen", "right_late_ms": 25},
    "encoders": {"room": "kitchen", "encoder_noise": 0.3, "encoder_step": 0.1},
    "cable": {"room": "kitchen", "cable": True},
    "screen": {"room": "kitchen", "screen": True},
    "linear": {"room": "kitchen", "looks": "covers", "gamma_light": 2.2, "blur": 1.0},  # light mixes, levels do not
    "window": {"wall": [1.0, 1.0, 1.0], "glows": True, "light": 0.55, "gamma_light": 2.2, "overexposed": 6},  # behind
    "sharpened": {"room": "kitchen", "sharpened": 1.2},  # as webcams do
    "trails": {"room": "kitchen", "trails": 0.4},  # noise averaged over time: what moves leaves a trail
    "fringes": {"room": "kitchen", "fringes": 0.003},  # red larger, blue smaller
    "fingers": {"room": "kitchen", "fingers_deg": 8},  # each finger somewhere else than its encoders say
    "glove": {"room": "kitchen", "glove_mm": 2.0},
    "stale": {"room": "kitchen", "right_late_ms": -100},  # the right picture is one behind
    "monochrome": {"room": "kitchen", "monochrome": True},
    "balance": {"room": "kitchen", "balance": 0.12},  # each camera's white wanders by this share, to and fro
    "shakes": {"room": "kitchen", "shakes_px": 1.5},  # the neck sways, and no encoder says so
    "jitter": {"room": "kitchen", "jitter_ms": 15},  # pictures are taken so much before or after their stamps
    "post": {"room": "kitchen", "post": True},  # stands between eyes and arm
    "frozen": {"room": "kitchen", "frozen": (12, 20)},  # the right camera sends its last picture again and again
    "lamp": {"room": "kitchen", "lamp": 1.0},  # swings: shadows and shading with it
}
# What is wrong with the robot beside its offsets, for `bodyschema diagnose`.
FAULTS = {
    "healthy": {},
    "link": {"link_mm": 6.0},
    "late": {"late_ms": 60.0},
    "hand": {"hand_scale": 1.03},
    "gain": {"gain": 1.02},
    "camera": {"camera_deg": 0.7},
    "forearm": {"forearm_mm": 3.0},
}


# ---- the robot -----------------------------------------------------------------------------------

def configuration_of(robot):
    text = (SOURCE / "config" / robot / "robot.yaml").read_text()
    return yaml.safe_load(re.sub(r"\$\{(\w+)\}", lambda m: os.environ[m.group(1)], text))


def numbers(text):
    return [float(x) for x in text.split()]


def rotation(rpy):
    r, p, y = rpy
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    return (np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
            @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]))


def quaternion(R):
    q = np.zeros(4)
    mujoco.mju_mat2Quat(q, np.ascontiguousarray(R).ravel())
    return q


def origin_of(element):
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    return np.array(numbers(origin.get("xyz", "0 0 0"))), rotation(numbers(origin.get("rpy", "0 0 0")))


class Urdf:
    """Links and joints, and of every joint which other one it mimics."""

    def __init__(self, file, roots):
        self.folder, self.roots = file.parent, roots
        tree = ElementTree.parse(file).getroot()
        self.links = {link.get("name"): link for link in tree.findall("link")}
        self.joints = {joint.get("name"): joint for joint in tree.findall("joint")}
        self.children = {}
        for joint in self.joints.values():
            self.children.setdefault(joint.find("parent").get("link"), []).append(joint)
        held = {joint.find("child").get("link") for joint in self.joints.values()}
        self.root = next(name for name in self.links if name not in held)
        self.mimics = {}
        for name, joint in self.joints.items():
            mimic = joint.find("mimic")
            if mimic is not None:
                self.mimics[name] = (mimic.get("joint"), float(mimic.get("multiplier", 1)),
                                     float(mimic.get("offset", 0)))

    def limits(self, joint):
        limit = self.joints[joint].find("limit")
        return float(limit.get("lower")), float(limit.get("upper"))

    def mesh(self, element):
        name = element.get("filename")
        if name.startswith("package://"):
            file = next(root / name[10:] for root in self.roots if (root / name[10:]).exists())
        else:
            file = self.folder / name
        mesh = trimesh.load(file, force="mesh", process=False)
        mesh.merge_vertices()
        scale = np.array(numbers(element.get("scale", "1 1 1")))
        return np.asarray(mesh.vertices) * scale, np.asarray(mesh.faces)


# ---- textures: this file's own, deterministic ------------------------------------------------------

def smooth_noise(random, size, cells):
    return cv2.resize(random.random((cells, cells, 3)).astype(np.float32), (size, size), interpolation=cv2.INTER_CUBIC)


def wood(random, size=512):
    y, x = np.mgrid[0:size, 0:size] / size
    wave = smooth_noise(random, size, 6)[..., 0]
    rings = 0.5 + 0.5 * np.sin(2 * math.pi * (9 * y + 2.5 * wave + 0.3 * np.sin(5 * x)))
    grain = smooth_noise(random, size, 128)[..., 1]
    shade = (0.72 + 0.2 * rings + 0.12 * grain)[..., None]
    return shade * np.array([0.66, 0.46, 0.28])


def bricks(random, size=512):
    picture = np.full((size, size, 3), 0.72)
    height, width = size // 12, size // 5
    for row in range(12):
        for column in range(-1, 6):
            left = column * width + (row % 2) * width // 2 + 4
            colour = np.array([0.58, 0.29, 0.22]) * random.uniform(0.75, 1.25)
            picture[row * height + 4:(row + 1) * height, max(0, left):max(0, left + width - 5)] = colour
    return picture * (0.88 + 0.24 * smooth_noise(random, size, 90))


def posters(random, size=512):
    """Papers, books and stripes at all angles, some as light and some as dark as robots are."""
    picture = np.ones((size, size, 3)) * random.uniform(0.5, 0.8, 3)
    for _ in range(46):
        centre, angle = random.uniform(0, size, 2), random.uniform(0, 180)
        box = cv2.boxPoints((tuple(centre), tuple(random.uniform(12, 140, 2)), angle)).astype(np.int32)
        grey = random.random() < 0.4
        colour = np.full(3, random.uniform(0.05, 0.95)) if grey else random.uniform(0.05, 0.95, 3)
        cv2.fillPoly(picture, [box], tuple(float(c) for c in colour))
    return picture * (0.9 + 0.2 * smooth_noise(random, size, 60))


def cloth(random, size=512):
    y, x = np.mgrid[0:size, 0:size]
    check = ((x // 24) % 2)[..., None] * 0.5 + ((y // 24) % 2)[..., None] * 0.5
    return (0.85 - 0.45 * check * np.array([0.2, 0.8, 0.9])) * (0.93 + 0.14 * smooth_noise(random, size, 256))


def plaster(random, colour, size=512):
    return (np.array(colour) * (0.94 + 0.08 * smooth_noise(random, size, 5))
            * (0.985 + 0.03 * smooth_noise(random, size, 160)))


def patches(random, first, second, cells, size=1024):
    """Two colours, or two lists of them, in smooth pieces of a wall."""
    first, second = np.atleast_2d(first), np.atleast_2d(second)
    choice = smooth_noise(random, size, cells)
    share = np.clip(40 * (choice[..., 0] - 0.5) + 0.5, 0, 1)[..., None]
    pick = (choice[..., 1] * 3.999).astype(int)
    return ((share * first[pick % len(first)] + (1 - share) * second[pick % len(second)])
            * (0.985 + 0.03 * smooth_noise(random, size, 160)))


def wall_picture(random, wall):
    if wall == "twin":  # what `looks_of` makes of gray links, as they look in the light
        return patches(random, [[g, g, 1.02 * g] for g in (0.38, 0.5, 0.6)], [0.36, 0.50, 0.44], 40)
    if wall == "door":
        return patches(random, [0.86, 0.62, 0.5], [0.36, 0.50, 0.44], 22)
    return plaster(random, wall)


def add_texture(spec, name, picture, kind=mujoco.mjtTexture.mjTEXTURE_2D, repeat=(1, 1), **looks):
    texture = spec.add_texture(name=name, type=kind, width=picture.shape[1], height=picture.shape[0], nchannel=3)
    faces = 6 if kind == mujoco.mjtTexture.mjTEXTURE_CUBE else 1
    texture.height = picture.shape[0] * faces
    texture.data = (np.clip(np.concatenate([picture] * faces), 0, 1) * 255).astype(np.uint8).tobytes()
    material = spec.add_material(name=name, texrepeat=list(repeat), **looks)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


# ---- the scene -----------------------------------------------------------------------------------

class Scene:
    """The robot in its room, with joints set by name and pictures of its two cameras.

    Root frame as the URDF has it: x backward, y right, z up (iCub). Lengths in m, angles in rad.
    """

    def __init__(self, robot, condition, seed, table_z=None):
        self.random = np.random.default_rng(seed * 7919 + 5)
        self.configuration = configuration_of(robot)
        own = self.configuration["robot"]
        folder = SOURCE / "config" / robot
        self.urdf = Urdf((folder / own["urdf"]).resolve(), [(folder / r).resolve() for r in own["mesh_search_roots"]])
        self.own, self.cameras, self.condition = own, self.configuration["cameras"], condition
        self.rendered = set(own["rendered_links"])
        self.begin()
        self.build(self.urdf.root, self.spec.worldbody, np.zeros(3), np.eye(3), None)
        self.add_cameras()
        self.add_lights()
        self.add_room(table_z)
        self.finish()

    def begin(self):
        self.spec = mujoco.MjSpec()
        self.spec.stat.extent, self.spec.stat.center = 1.0, [0, 0, 0]
        visual = self.spec.visual
        visual.map.znear, visual.map.zfar = 0.01, 12.0
        visual.map.shadowclip, visual.map.shadowscale = 1.5, 0.9
        visual.quality.shadowsize, visual.quality.offsamples = 2048, 0
        visual.global_.offwidth, visual.global_.offheight = 2048, 1536
        self.bodies = {}
        self.points = []  # of the arm: (link, points in its frame)
        self.visuals = []  # (name, (link, its mesh, its looks))

    def finish(self):
        self.model = self.spec.compile()
        self.data = mujoco.MjData(self.model)
        self.option = mujoco.MjvOption()
        self.renderers = {}
        self.light = [self.model.light_diffuse.copy(), self.model.light_ambient.copy()]

    # -- robot

    def build(self, link, parent, xyz, R, joint):
        body = parent.add_body(name="link " + link, pos=xyz, quat=quaternion(R))
        body.mass, body.inertia, body.explicitinertial = 1.0, [0.01] * 3, True
        self.bodies[link] = body
        if joint is not None and joint.get("type") in ("revolute", "continuous"):
            axis = joint.find("axis")
            hinge = body.add_joint(name=joint.get("name"), type=mujoco.mjtJoint.mjJNT_HINGE,
                                   axis=numbers(axis.get("xyz")) if axis is not None else [1, 0, 0])
            hinge.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        if link in self.rendered:
            for k, visual in enumerate(self.urdf.links[link].findall("visual")):
                self.add_visual(link, k, visual, body)
        for child in self.urdf.children.get(link, []):
            child_xyz, child_R = origin_of(child)
            child_xyz = self.moved_joint(child.get("name"), child_xyz) * self.hand_scale(link)
            self.build(child.find("child").get("link"), body, child_xyz, child_R, child)

    def hand_scale(self, link):
        return self.condition.get("hand_scale", 1) if link.startswith("r_hand") or re.match(DIGITS, link) else 1

    def moved_joint(self, joint, xyz):
        """A forearm that is longer than the model says: the wrist's first joint sits further from the elbow."""
        longer = self.condition.get("link_mm", 0) * 1e-3
        if longer == 0 or joint != "r_wrist_pitch":
            return xyz
        length = np.linalg.norm(xyz)
        return xyz * (1 + longer / length) if length > 1e-6 else xyz

    def add_visual(self, link, k, visual, body):
        element = visual.find("geometry").find("mesh")
        if element is None:
            return
        vertices, faces = self.urdf.mesh(element)
        xyz, R = origin_of(visual)
        vertices = vertices @ R.T + xyz
        vertices = vertices * self.hand_scale(link)
        if self.condition.get("forearm_mm", 0) and link == "r_forearm":
            normals = trimesh.Trimesh(vertices, faces, process=False).vertex_normals
            vertices = vertices + normals * self.condition["forearm_mm"] * 1e-3
        if self.condition.get("glove_mm", 0) and (link.startswith("r_hand") or re.match(DIGITS, link)):
            normals = trimesh.Trimesh(vertices, faces, process=False).vertex_normals
            vertices = vertices + normals * self.condition["glove_mm"] * 1e-3
        if self.condition.get("thicker_mm", 0):
            normals = trimesh.Trimesh(vertices, faces, process=False).vertex_normals
            vertices = vertices + normals * self.condition["thicker_mm"] * 1e-3
        name = f"{link}_{k}"
        mesh = self.spec.add_mesh(name=name)
        mesh.uservert, mesh.userface = vertices.ravel().tolist(), faces.ravel().tolist()
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        rgba, material = self.looks_of(link)
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=0, conaffinity=0, rgba=rgba)
        geom.material = material
        self.points.append((link, vertices[:: max(1, len(vertices) // 40)]))
        self.visuals.append((name, (link, vertices, faces, rgba, material)))

    def looks_of(self, link):
        looks = self.condition["looks"]
        self.material("matt", 0.15, 0.2)
        self.material("gloss", 0.9, 0.8)
        digits = re.search(DIGITS, link) is not None
        if looks == "covers":  # white glossy shells, black joints and fingers
            dark = digits or "wrist" in link or "elbow" in link
            return ([0.09, 0.09, 0.1, 1] if dark else [0.93, 0.93, 0.9, 1]), "gloss"
        if looks == "white":
            return [0.93, 0.93, 0.9, 1], "gloss"
        if looks == "skin":
            return ([0.86, 0.62, 0.5, 1] if digits or "hand" in link else [0.78, 0.74, 0.7, 1]), "matt"
        shade = 0.35 + 0.4 * ((sum(map(ord, link)) * 37 % 100) / 100)
        return [shade, shade, shade * 1.02, 1], "matt"

    def material(self, name, specular, shininess):
        if self.spec.material(name) is None:
            self.spec.add_material(name=name, specular=specular, shininess=shininess, rgba=[1, 1, 1, 1])

    def add_cameras(self):
        turn = np.diag([1.0, -1.0, -1.0])  # MuJoCo looks along -z with y up, OpenCV along z with y down
        for name, camera in self.cameras.items():
            f = camera["fx"]
            width, height = self.wide(camera)
            assert camera["fy"] == f and camera["cx"] == (camera["width"] - 1) / 2
            turned = self.condition.get("camera_deg", 0) * DEG if name == "left" else 0
            added = self.bodies[camera["link"]].add_camera(name=name, quat=quaternion(rotation([0, turned, 0]) @ turn))
            added.fovy = 2 * math.degrees(math.atan(height / 2 / f))

    def wide(self, camera):
        """The size that is drawn, px of the camera: what the bent lens sees of it is more than a straight one does."""
        if not self.condition.get("k1"):
            return camera["width"], camera["height"]
        return int(camera["width"] * 1.4), int(camera["height"] * 1.4)

    # -- light and room

    def add_lights(self):
        head = self.spec.visual.headlight
        head.ambient, head.diffuse, head.specular = [0.28] * 3, [0.0] * 3, [0.0] * 3
        world = self.spec.worldbody
        directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        turn = self.random.uniform(-0.25, 0.25, 2)
        if self.condition.get("sun"):
            head.ambient = [0.18] * 3
            world.add_light(name="window", type=directional, dir=[-0.85 + turn[0], -0.3 + turn[1], -0.4],
                            pos=[1.6, 0.6, 0.9], diffuse=[1.15, 1.1, 1.0], ambient=[0.08] * 3, specular=[0.5] * 3,
                            castshadow=True)
            return
        world.add_light(name="window", type=directional, dir=[-0.45 + turn[0], -0.5 + turn[1], -0.75],
                        pos=[0.3, 0.9, 1.6], diffuse=[0.72, 0.72, 0.76], ambient=[0.08] * 3, specular=[0.5] * 3,
                        castshadow=True)
        world.add_light(name="lamp", pos=[0.2, -1.1, 1.4], dir=[-0.4, 0.75, -0.9], diffuse=[0.52, 0.48, 0.41],
                        ambient=[0.05] * 3, specular=[0.4] * 3, castshadow=True, cutoff=80,
                        attenuation=[0.6, 0.2, 0.05])
        world.add_light(name="bounce", type=directional, dir=[0.6, 0.1, 0.4], pos=[-1, 0, -1], diffuse=[0.12] * 3,
                        specular=[0] * 3, castshadow=False)

    def add_room(self, table_z):
        if table_z is None:
            return
        kitchen = self.condition["room"] == "kitchen"
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        spec, world = self.spec, self.spec.worldbody
        cube = mujoco.mjtTexture.mjTEXTURE_CUBE
        if not kitchen:
            add_texture(spec, "plaster", wall_picture(self.random, self.condition["wall"]),
                        emission=1.0 if self.condition.get("glows") else 0.0)
            behind = self.condition.get("behind", -1.2)
            world.add_geom(type=plane, size=[4, 4, 0.1], pos=[behind, 0, 0], quat=quaternion(rotation([0, 90 * DEG, 0])),
                           material="plaster", contype=0, conaffinity=0)
            world.add_geom(type=plane, size=[4, 4, 0.1], pos=[0, 0, table_z - 0.4], material="plaster", contype=0,
                           conaffinity=0)
            return
        add_texture(spec, "bricks", bricks(self.random), repeat=(3, 3))
        add_texture(spec, "posters", posters(self.random), repeat=(2, 2))
        add_texture(spec, "floor", cloth(self.random), repeat=(4, 4))
        add_texture(spec, "wood", wood(self.random), kind=cube, specular=0.4, shininess=0.4,
                    reflectance=self.condition.get("reflectance", 0))
        if self.condition.get("screen"):
            add_texture(spec, "screen", posters(self.random, 256), emission=0.8)
            world.add_geom(type=plane, contype=0, conaffinity=0, size=[0.7, 0.5, 0.1], pos=[-1.1, 0, table_z + 0.25],
                           quat=quaternion(rotation([0, 90 * DEG, 0])), material="screen")
        for k in range(4):
            add_texture(spec, f"paper{k}", posters(self.random, 256), kind=cube)
        wall = dict(type=plane, contype=0, conaffinity=0)
        world.add_geom(size=[2.5, 2.5, 0.1], pos=[-1.5, 0, 0.6], quat=quaternion(rotation([0, 90 * DEG, 0])),
                       material="bricks", **wall)
        world.add_geom(size=[2.5, 2.5, 0.1], pos=[0, 1.6, 0.6], quat=quaternion(rotation([90 * DEG, 0, 0])),
                       material="posters", **wall)
        world.add_geom(size=[2.5, 2.5, 0.1], pos=[0, -1.6, 0.6], quat=quaternion(rotation([-90 * DEG, 0, 0])),
                       material="posters", **wall)
        world.add_geom(size=[3, 3, 0.1], pos=[0, 0, table_z - 0.7], material="floor", **wall)
        table = dict(type=mujoco.mjtGeom.mjGEOM_BOX, contype=0, conaffinity=0)
        world.add_geom(size=[0.4, 0.7, 0.015], pos=[-0.55, 0.1, table_z - 0.015], material="wood", **table)
        self.add_things(table_z)

    def add_things(self, table_z):
        kinds = [mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_ELLIPSOID]
        for k in range(14):
            size = self.random.uniform(0.015, 0.055, 3)
            size[2] = min(size[2], 0.03)
            spot = [self.random.uniform(-0.9, -0.2), self.random.uniform(-0.5, 0.7)]
            low = kinds[k % 3] == mujoco.mjtGeom.mjGEOM_CYLINDER
            grey = self.random.random() < 0.4
            colour = np.full(3, self.random.uniform(0.1, 0.95)) if grey else self.random.uniform(0.1, 0.95, 3)
            turned = quaternion(rotation([0, 0, self.random.uniform(0, 3)]))
            geom = self.spec.worldbody.add_geom(type=kinds[k % 3], size=size,
                                                pos=[*spot, table_z + (size[1] if low else size[2])], quat=turned,
                                                rgba=[*colour, 1], contype=0, conaffinity=0)
            if k % 4 == 0:
                geom.material, geom.rgba = f"paper{k // 4}", [1, 1, 1, 1]
        for k in range(7):  # what stands about further away
            size = self.random.uniform(0.06, 0.25, 3)
            self.spec.worldbody.add_geom(type=kinds[0], size=size, material=f"paper{k % 4}",
                                         pos=[self.random.uniform(-1.45, -1.0), self.random.uniform(-1.3, 1.3),
                                              table_z + self.random.uniform(-0.6, 0.7)],
                                         quat=quaternion(rotation([0, 0, self.random.uniform(0, 3)])), contype=0,
                                         conaffinity=0)

    # -- pose

    def set_joints(self, angles):
        """@param angles  true ones by joint, rad; what mimics another follows it, the rest is 0."""
        for name, joint in self.urdf.joints.items():
            if joint.get("type") not in ("revolute", "continuous"):
                continue
            if name in self.urdf.mimics:
                other, factor, offset = self.urdf.mimics[name]
                value = factor * angles.get(other, 0.0) + offset
            else:
                value = angles.get(name, 0.0)
            self.data.qpos[self.model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(self.model, self.data)

    def pose(self, link):
        body = self.data.body("link " + link)
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = body.xmat.reshape(3, 3), body.xpos
        return X

    def in_camera(self, camera, link="", p_B=(0, 0, 0)):
        """A point of a link in a camera's frame, OpenCV's axes, as the model believes the camera to sit."""
        p_C = np.linalg.inv(self.pose(self.cameras[camera]["link"])) @ self.pose(link) @ np.array([*p_B, 1.0])
        return p_C[:3]

    # -- pictures

    def draw(self, camera, mask=False):
        """One picture, RGB in levels as floats, before lens and noise; or which samples show the arm."""
        width, height = self.wide(self.cameras[camera])
        if camera not in self.renderers:
            renderer = mujoco.Renderer(self.model, height * FINER, width * FINER)
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_CULL_FACE] = 0
            self.renderers[camera] = renderer
        renderer = self.renderers[camera]
        if mask:
            renderer.enable_segmentation_rendering()
        renderer.update_scene(self.data, camera)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_CULL_FACE] = 0
        picture = renderer.render()
        if mask:
            renderer.disable_segmentation_rendering()
            arm = {g for g in range(self.model.ngeom)
                   if self.model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH}
            return np.isin(picture[..., 0], list(arm)) & (picture[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM))
        return picture.astype(np.float32)


class Lens:
    """Bends a straight, wide drawing as k1 says and brings it to the camera's size."""

    def __init__(self, camera, wide, k1):
        self.size = (camera["width"], camera["height"])
        self.map = None
        if not k1:
            return
        width, height = self.size
        f, fine = camera["fx"], FINER
        v, u = np.mgrid[0:height * fine, 0:width * fine].astype(np.float64)
        x = ((u + 0.5) / fine - 0.5 - camera["cx"]) / f
        y = ((v + 0.5) / fine - 0.5 - camera["cy"]) / f
        bent = np.hypot(x, y)
        r_max = math.sqrt(1 / (-3 * k1)) if k1 < 0 else 2.0  # where the lens folds back: no light from beyond
        straight = np.linspace(0, r_max, 4000)
        r = np.interp(bent, straight * (1 + k1 * straight**2), straight, right=np.nan)
        scale = np.where(bent > 1e-9, r / np.maximum(bent, 1e-9), 1.0)
        wide_u = ((x * scale * f + (wide[0] - 1) / 2) + 0.5) * FINER - 0.5
        wide_v = ((y * scale * f + (wide[1] - 1) / 2) + 0.5) * FINER - 0.5
        self.map = (np.nan_to_num(wide_u, nan=-9).astype(np.float32), np.nan_to_num(wide_v, nan=-9).astype(np.float32))

    def __call__(self, picture):
        if self.map is not None:
            picture = cv2.remap(picture, *self.map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        return cv2.resize(picture, self.size, interpolation=cv2.INTER_AREA)


# ---- motion --------------------------------------------------------------------------------------

def resting_posture(robot):
    """How head and fingers stand, deg."""
    if robot == "icub_right":
        fingers = {"r_thumb_oppose": 40, "r_thumb_proximal": 14, "r_thumb_distal": 22, "r_index_proximal": 12,
                   "r_index_distal": 28, "r_middle_proximal": 18, "r_middle_distal": 30, "r_pinky": 45}
    else:
        fingers = {"r_hand_thumb_0_joint": 40}
        fingers.update({f"r_hand_thumb_{k}_joint": 12 for k in (1, 2, 3)})
        fingers.update({f"r_hand_{f}_{k}_joint": 14 for f in ("index", "middle", "ring", "little") for k in (1, 2, 3)})
    return {"neck_pitch": -24, "eyes_tilt": -16, **fingers}


class Motion:
    """Reaches from posture to posture: some rest in each (a second, mostly), minimum jerk between."""

    def __init__(self, scene, robot, seed, seconds):
        self.scene, self.random = scene, np.random.default_rng(seed * 104729 + 1)
        self.rest = {name: value * DEG for name, value in resting_posture(robot).items()}
        self.arm = scene.own["estimated_joints"]
        self.follows = scene.condition["head"] == "gaze"
        self.away = scene.condition.get("away", [])
        self.knots = []
        t, last = 0.0, None
        while t < seconds + 3:
            target = self.next_target(last)
            if last is not None:
                move = max(0.8, 1.875 * max(abs(target[j] - last[j]) for j in self.arm) / (55 * DEG))
                self.knots.append((t, t + move, last, target))
                t += move
            rest = scene.condition["rest"]
            self.knots.append((t, t + rest, target, target))
            t, last = t + rest, target
        self.postures = sum(1 for knot in self.knots if knot[2] is knot[3])

    def visible(self, angles):
        self.scene.set_joints(angles)
        tips = [self.scene.own["hand_link"], *self.scene.own["fingertip_links"]]
        for camera, k in self.scene.cameras.items():
            for link in tips:
                x, y, z = self.scene.in_camera(camera, link)
                if z < 0.1:
                    return False
                u, v = k["fx"] * x / z + k["cx"], k["fy"] * y / z + k["cy"]
                if not (8 < u < k["width"] - 9 and 8 < v < k["height"] - 9):
                    return False
        distance = np.linalg.norm(self.scene.in_camera("left", tips[0]))
        return 0.25 < distance < 0.45

    def next_target(self, last):
        for _ in range(20000):
            arm = {j: self.random.uniform(*self.scene.urdf.limits(j)) for j in self.arm}
            if last is not None:  # a part of the way: whole jumps leave the view
                share = self.random.uniform(0.35, 1.0)
                arm = {j: last[j] + share * (arm[j] - last[j]) for j in self.arm}
                if max(abs(arm[j] - last[j]) for j in self.arm) < 15 * DEG:
                    continue
            target = self.with_head({**self.rest, **arm})
            if not self.visible(target):
                continue
            if last is not None and not all(self.visible(self.with_head(between(last, target, s)))
                                            for s in (0.25, 0.5, 0.75)):
                continue
            return target
        sys.exit("no posture in view was found")

    def with_head(self, angles):
        """Neck turned so that the hand is in the middle, as far as it goes."""
        if not self.follows:
            return angles
        angles = dict(angles)
        for _ in range(3):
            self.scene.set_joints(angles)
            x, y, z = self.scene.in_camera("left", self.scene.own["hand_link"])
            if z < 0.05:
                break
            for name, error, reach in (("neck_yaw", math.atan2(x, z), 35 * DEG),
                                       ("neck_pitch", math.atan2(y, z), 18 * DEG)):
                was = self.rest.get(name, 0.0)
                angles[name] = min(was + reach, max(was - reach, angles.get(name, 0.0) - 0.8 * error))
        return angles

    def at(self, t):
        """Angles, rad. While it is away the arm hangs beside the body; it takes 1.5 s to get there, and back."""
        working = self.working(t)
        out = max((min(1.0, max(0.0, (t - begin) / 1.5 if begin > 0 else 1.0), max(0.0, (end - t) / 1.5))
                   for begin, end in self.away), default=0.0)
        if out == 0:
            return working
        return between(working, {**working, **{j: 0.0 for j in self.arm}}, out * out * (3 - 2 * out))

    def working(self, t):
        for begin, end, a, b in self.knots:
            if t < end:
                s = max(0.0, (t - begin) / (end - begin))
                return between(a, b, s**3 * (10 - 15 * s + 6 * s * s))
        return dict(self.knots[-1][3])


def between(a, b, s):
    return {name: a.get(name, 0.0) + s * (b.get(name, 0.0) - a.get(name, 0.0)) for name in {**a, **b}}


def lowest(scene, motion, seconds):
    """The lowest point of forearm and hand over the motion, m: the table lies below it."""
    low = 1.0
    for t in np.arange(0, seconds, 0.25):
        scene.set_joints(motion.at(t))
        for link, points in scene.points:
            if "upper" in link or "elbow" in link:
                continue
            X = scene.pose(link)
            low = min(low, float((points @ X[:3, :3].T + X[:3, 3])[:, 2].min()))
    return low


def furthest(scene, motion, seconds):
    """The point of the arm that gets furthest from the robot's body, along -x of the root frame, m."""
    far = 0.0
    for t in np.arange(0, seconds, 0.25):
        scene.set_joints(motion.at(t))
        for link, points in scene.points:
            X = scene.pose(link)
            far = min(far, float((points @ X[:3, :3].T + X[:3, 3])[:, 0].min()))
    return far


# ---- things that are no robot --------------------------------------------------------------------

def add_box(scene, motion):
    """A box between thumb and fingers, fixed to the hand."""
    scene.set_joints(motion.at(0))
    hand = scene.pose(scene.own["hand_link"])
    tips = [scene.pose(link)[:3, 3] for link in scene.own["fingertip_links"]]
    fingers = (tips[1] + tips[2]) / 2
    centre = 0.5 * (tips[0] + fingers)
    along = tips[2] - tips[1]
    along /= np.linalg.norm(along)
    through = tips[0] - fingers - along * (along @ (tips[0] - fingers))
    through /= np.linalg.norm(through)
    R = np.column_stack([along, through, np.cross(along, through)])
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, centre
    X = np.linalg.inv(hand) @ X
    size = scene.condition["box"] if isinstance(scene.condition["box"], list) else [0.055, 0.02, 0.032]
    return dict(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=X[:3, 3], quat=quaternion(X[:3, :3]),
                contype=0, conaffinity=0)


def person_parts(body, colour=(0.84, 0.62, 0.5)):
    """A forearm with sleeve and a hand with fingers, reaching along the body's x."""
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    looks = dict(contype=0, conaffinity=0)
    body.add_geom(type=capsule, size=[0.042, 0, 0], fromto=[-0.9, 0, 0, -0.28, 0, 0], rgba=[0.15, 0.25, 0.5, 1],
                  **looks)
    body.add_geom(type=capsule, size=[0.03, 0, 0], fromto=[-0.28, 0, 0, -0.05, 0, 0], rgba=[*colour, 1], **looks)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=[0.05, 0.04, 0.018], rgba=[*colour, 1], **looks)
    for k in range(4):
        y = -0.03 + 0.02 * k
        body.add_geom(type=capsule, size=[0.008, 0, 0], fromto=[0.03, y, 0, 0.1, 1.3 * y, -0.012], rgba=[*colour, 1],
                      **looks)


def person_pose(scene, motion, t, seed):
    """Every eight seconds an arm comes from the left, holds before or behind the hand, and goes again."""
    turn = int(t // 8)
    s = t - 8 * turn - 3
    near = np.clip(min(s / 0.8, (3 - s) / 0.8), 0, 1)
    near = near * near * (3 - 2 * near)
    random = np.random.default_rng(seed * 31 + turn)
    scene.set_joints(motion.at(t))
    X = scene.pose(scene.cameras["left"]["link"])
    x, y, z = scene.in_camera("left", scene.own["hand_link"])
    depth = z + random.choice([-0.09, 0.12])
    goal = np.array([x / z * depth + random.uniform(-0.03, 0.02), y / z * depth + random.uniform(-0.03, 0.03), depth])
    away = np.array([-0.75, 0.1, 0.0])
    tilt = random.uniform(-0.5, 0.5)
    R = np.column_stack([[math.cos(tilt), math.sin(tilt), 0.0], [-math.sin(tilt), math.cos(tilt), 0.0], [0, 0, 1]])
    return X[:3, 3] + X[:3, :3] @ (goal + (1 - near) * away), quaternion(X[:3, :3] @ R)


def second_arm_pose(scene, t):
    """The robot's other arm works on its own side: grey, and moved slowly through the view's edge."""
    at = np.array([-0.42 + 0.05 * math.sin(0.9 * t), -0.16 + 0.09 * math.sin(0.55 * t),
                   0.07 + 0.05 * math.sin(0.7 * t)])
    R = rotation([0.4 * math.sin(0.6 * t), -0.25, math.pi - 0.6 + 0.25 * math.sin(0.8 * t)])
    return at, quaternion(R)


def add_left_arm(scene, body):
    """Hand and forearm of the other side, stiff as the right ones are at rest: mirrored in the plane between the eyes."""
    scene.set_joints({})  # links as they hang, from one another
    hand = np.linalg.inv(scene.pose(scene.own["hand_link"]))
    mirror = np.array([1.0, -1.0, 1.0])
    for name, visual in scene.visuals:
        link, vertices, faces, rgba, material = visual
        if not (link.startswith(("r_hand", "r_forearm", "r_wrist")) or re.match(DIGITS, link)):
            continue
        X = hand @ scene.pose(link)
        mesh = scene.spec.add_mesh(name="left " + name)
        mesh.uservert = ((vertices @ X[:3, :3].T + X[:3, 3]) * mirror).ravel().tolist()
        mesh.userface = faces[:, ::-1].ravel().tolist()
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, contype=0, conaffinity=0, rgba=rgba)
        geom.material = material


def left_arm_pose(scene, motion, t):
    """What the right hand did 3.3 s before, mirrored, and 4 cm nearer to the middle."""
    scene.set_joints(motion.at(max(0.0, t - 3.3) if t > 3.3 else 6.6 - t))
    X = scene.pose(scene.own["hand_link"])
    S = np.diag([1.0, -1.0, 1.0])
    p = S @ X[:3, 3]
    return p + np.array([0, 0.04, 0]), quaternion(S @ X[:3, :3] @ S)


def box_pose(scene, motion, box, t, table_z):
    """Held from 5 to 11 s, from 17 to 23 s and so on; it is laid on the table, and fetched there, within half a second."""
    in_turn = (t - 5) % 12
    if t >= 5 and in_turn <= 6:
        return held_pose(scene, motion, box, t)
    let_go = 11 + 12 * math.floor((t - 11) / 12) if t > 11 else 5.0
    taken = 5 + 12 * math.ceil((t - 5) / 12)
    (p_A, q_A), (p_B, q_B) = held_pose(scene, motion, box, let_go), held_pose(scene, motion, box, taken)
    lying = np.array([p_A[0], p_A[1], table_z + min(box["size"])])
    flat = quaternion(rotation([90 * DEG, 0, 0]))
    if t - let_go < 0.5 and t > 11:
        return lying + (1 - (t - let_go) / 0.5) * (p_A - lying), flat
    if taken - t < 0.5:
        return lying + (1 - (taken - t) / 0.5) * (p_B - lying), q_B
    return lying, flat


def held_pose(scene, motion, box, t):
    scene.set_joints(motion.at(t))
    X = scene.pose(scene.own["hand_link"])
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, box["quat"])
    return X[:3, :3] @ box["pos"] + X[:3, 3], quaternion(X[:3, :3] @ R.reshape(3, 3))


def add_cable(scene):
    """A black cable of 9 mm that hangs along the outside of the forearm, from its elbow end to the back of the hand."""
    link = next(link for link, *_ in (visual for _, visual in scene.visuals) if "forearm" in link)
    points = np.concatenate([v for _, (l, v, *_) in scene.visuals if l == link])
    centre = points.mean(0)
    along = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    side = np.linalg.svd(points - centre, full_matrices=False)[2][1]
    s = (points - centre) @ along
    radius = np.percentile(np.abs((points - centre) @ side), 90)
    knots = [centre + along * a + side * radius * b
             for a, b in zip(np.linspace(s.min(), s.max(), 6), (0.9, 1.25, 1.5, 1.55, 1.35, 1.0))]
    for a, b in zip(knots, knots[1:]):
        scene.bodies[link].add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.0045, 0, 0], fromto=[*a, *b],
                                    rgba=[0.05, 0.05, 0.06, 1], contype=0, conaffinity=0)


def add_post(scene, bare, motion):
    """Upright, 16 mm thick, a little over half of the way from the eyes to where the hand is in the middle of the log."""
    bare.set_joints(motion.at(bare.condition["seconds"] / 2))
    eye = np.mean([bare.pose(k["link"])[:3, 3] for k in bare.cameras.values()], axis=0)
    at = eye + 0.55 * (bare.pose(bare.own["hand_link"])[:3, 3] - eye)
    scene.spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.008, 0, 0], contype=0, conaffinity=0,
                                  fromto=[*at[:2], at[2] - 1.0, *at[:2], at[2] + 1.0], rgba=[0.5, 0.42, 0.35, 1])


# ---- what cameras do to a picture ------------------------------------------------------------------

class Exposure:
    """Brings its own camera's mean to 105 levels, a third of the way from picture to picture, with its own white."""

    def __init__(self, camera):
        self.gain = 1.0
        self.white = {"left": np.array([1.06, 1.0, 0.92])}.get(camera, np.array([0.92, 1.0, 1.1]))

    def __call__(self, picture):
        out = picture * self.gain * self.white
        self.gain *= (105 / max(1.0, np.clip(out, 0, 255).mean())) ** 0.33
        return out


def to_light(picture, condition):
    """Levels as light, of which what is white may have been far more than white."""
    light = 255 * (picture / 255) ** condition["gamma_light"]
    more = np.clip((picture.min(axis=-1, keepdims=True) - 225) / 30, 0, 1) * (condition.get("overexposed", 1) - 1)
    return light * (1 + more)


def to_levels(light, condition):
    return 255 * np.clip(light / 255, 0, 1) ** (1 / condition["gamma_light"])


def with_fringes(picture, share):
    """Red is larger by this share than green, blue smaller."""
    height, width = picture.shape[:2]
    out = picture.copy()
    for channel, scale in ((0, 1 + share), (2, 1 - share)):
        M = np.array([[scale, 0, (1 - scale) * (width - 1) / 2], [0, scale, (1 - scale) * (height - 1) / 2]])
        out[..., channel] = cv2.warpAffine(picture[..., channel], M, (width, height), flags=cv2.INTER_LINEAR,
                                           borderMode=cv2.BORDER_REPLICATE)
    return out


class WornSensor:
    """A rim at half the light, a pattern of 4 levels that stands, and one pixel in a thousand that is black or white."""

    def __init__(self, random, size):
        width, height = size
        v, u = np.mgrid[0:height, 0:width]
        r2 = ((u - width / 2) ** 2 + (v - height / 2) ** 2) / (width ** 2 / 4 + height ** 2 / 4)
        self.rim = (1 - 0.5 * r2)[..., None]
        self.pattern = random.normal(0, 4, (height, width, 3))
        dead = random.random((height, width))
        self.black, self.white = dead < 0.0005, dead > 0.9995

    def __call__(self, picture):
        out = picture * self.rim + self.pattern
        out[self.black], out[self.white] = 5, 250
        return out


# ---- a log ---------------------------------------------------------------------------------------

def message_types():
    """The product's own types, made from its .lcm files."""
    if "bot_core" not in sys.modules:
        folder = tempfile.mkdtemp(prefix="foreign_types_")
        files = sorted(str(f) for f in (SOURCE / "src/bus/lcmtypes").glob("*.lcm"))
        subprocess.run(["lcm-gen", "-p", "--ppath", folder, *files], check=True)
        sys.path.insert(0, folder)
    import bot_core
    return bot_core


def joint_message(names, positions, utime):
    message = message_types().joint_state_t()
    message.utime, message.num_joints, message.joint_name = utime, len(names), list(names)
    message.joint_position = [float(p) for p in positions]
    message.joint_velocity = message.joint_effort = [0.0] * len(names)
    return message.encode()


def picture_message(pictures, utime, quality):
    types = message_types()
    message = types.images_t()
    message.utime, message.n_images, message.image_types = utime, len(pictures), list(range(len(pictures)))
    for picture in pictures:
        image = types.image_t()
        image.utime, image.height, image.width = utime, picture.shape[0], picture.shape[1]
        if quality:
            done, data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
            assert done
            image.data, image.row_stride, image.pixelformat = data.tobytes(), 0, types.image_t.PIXEL_FORMAT_MJPEG
        else:
            image.data, image.row_stride = picture.tobytes(), 3 * picture.shape[1]
            image.pixelformat = types.image_t.PIXEL_FORMAT_RGB
        image.size, image.nmetadata, image.metadata = len(image.data), 0, []
        message.images.append(image)
    return message.encode()


class Player:
    def __init__(self, robot, condition, seed):
        self.robot, self.seed = robot, seed
        self.condition = {**PLAIN, **condition}
        bare = Scene(robot, self.condition, seed)
        self.seconds = self.condition["seconds"]
        self.motion = Motion(bare, robot, seed, self.seconds)
        table_z = lowest(bare, self.motion, self.seconds) - 0.025
        self.table_z, self.bare = table_z, bare
        if self.condition.get("near_wall"):
            self.condition["behind"] = furthest(bare, self.motion, self.seconds) - 0.04
        self.scene = Scene.__new__(Scene)
        self.held = add_box(bare, self.motion) if self.condition.get("box") else None
        self.build(robot, table_z)
        self.random = np.random.default_rng(seed * 15485863 + 3)
        largest = 0 if self.condition.get("exact") else 5
        self.offsets = {j: self.random.uniform(-largest, largest) for j in self.scene.own["estimated_joints"]}
        gain = self.condition.get("gain", 1)
        self.gains = {"r_elbow": gain, "r_shoulder_roll": 1.0}
        self.lenses = {name: Lens(k, self.scene.wide(k), self.condition.get("k1", 0))
                       for name, k in self.scene.cameras.items()}
        self.before = {}  # the last picture, by camera
        self.sway = np.zeros(2)  # px
        self.swing = self.scene.model.light_dir.copy()
        self.exposures = {name: Exposure(name) for name in self.scene.cameras}
        self.worn = {name: WornSensor(self.random, (k["width"], k["height"]))
                     for name, k in self.scene.cameras.items()} if self.condition.get("worn") else {}

    def build(self, robot, table_z):
        """The scene again, with its room and what moves in it."""
        held, condition, bare, motion = self.held, self.condition, self.bare, self.motion

        class Furnished(Scene):
            def add_room(self, table_z):
                super().add_room(table_z)
                if held is not None:
                    picture = posters(self.random, 128)
                    add_texture(self.spec, "held", picture, kind=mujoco.mjtTexture.mjTEXTURE_CUBE)
                    if condition.get("turns"):
                        free = {k: v for k, v in held.items() if k not in ("pos", "quat")}
                        self.spec.worldbody.add_body(name="box", mocap=True).add_geom(material="held", **free)
                    else:
                        self.bodies[self.own["hand_link"]].add_geom(material="held", **held)
                if condition.get("cable"):
                    add_cable(self)
                if condition.get("post"):
                    add_post(self, bare, motion)
                if condition.get("person"):
                    person_parts(self.spec.worldbody.add_body(name="person", mocap=True, pos=[9, 9, 9]))
                if condition.get("second_arm"):
                    other = self.spec.worldbody.add_body(name="second_arm", mocap=True, pos=[9, 9, 9])
                    person_parts(other, (0.55, 0.55, 0.56))
                if condition.get("left_arm"):
                    bare.spec = self.spec
                    add_left_arm(bare, self.spec.worldbody.add_body(name="left_arm", mocap=True, pos=[9, 9, 9]))

        self.scene = Furnished(robot, self.condition, self.seed, table_z)

    def encoders(self, t):
        """@return names and what the encoders say, rad: true + offset, noise of 0.02 deg, steps of 2^-12 turns, or so."""
        true = self.motion.at(t)
        names = [n for n, j in self.scene.urdf.joints.items()
                 if j.get("type") in ("revolute", "continuous") and n not in self.scene.urdf.mimics]
        wrong = self.condition.get("fingers_deg", 0) * DEG
        fingers = np.random.default_rng(self.seed * 6151).uniform(-wrong, wrong, 5)
        step = self.condition["encoder_step"] * DEG if "encoder_step" in self.condition else 2 * math.pi / 4096
        values = []
        for name in names:
            value = true.get(name, 0.0) * self.gains.get(name, 1.0) + self.offsets.get(name, 0.0) * DEG
            finger = re.search("thumb|index|middle|ring|pinky|little", name)
            if finger and wrong:
                value += fingers[["thumb", "index", "middle", "ring", "pinky", "little"].index(finger[0]) % 5]
            noisy = value + self.random.normal(0, self.condition.get("encoder_noise", 0.02) * DEG)
            values.append(value if self.condition.get("exact") else round(noisy / step) * step)
        return names, values

    def light(self, t):
        """Drifts over the log, redder as it grows, and flickers from picture to picture."""
        drift, flicker = self.condition.get("drift", 0), self.condition.get("flicker", 0)
        gain = self.condition.get("light", 1) * (1 + drift * t / self.seconds) * (1 + self.random.normal(0, flicker) if flicker else 1)
        return gain * np.array([1 + 0.25 * drift * t / self.seconds, 1, 1 - 0.25 * drift * t / self.seconds])

    def picture(self, camera, t):
        gain = self.light(t)
        model, (diffuse, ambient) = self.scene.model, self.scene.light
        model.light_diffuse[:], model.light_ambient[:] = diffuse * gain, ambient * gain
        model.vis.headlight.ambient[:] = 0.28 * gain
        mujoco.mj_forward(self.scene.model, self.scene.data)
        drawn = self.scene.draw(camera)
        if "gamma_light" in self.condition:
            drawn = to_light(drawn, self.condition)
        picture = self.lenses[camera](drawn) * self.balance(camera, t)
        if "shakes_px" in self.condition:
            picture = self.shaken(camera, picture)
        picture = cv2.GaussianBlur(picture, (0, 0), self.condition.get("blur", 0.45))
        if "gamma_light" in self.condition:
            picture = to_levels(picture, self.condition)
        picture = self.as_the_camera_has_it(camera, picture)
        if self.condition.get("monochrome"):
            picture = np.repeat(picture @ np.array([[0.299], [0.587], [0.114]]), 3, axis=-1)
        # Shot noise and read noise: bright pixels are noisier.
        sd = self.condition.get("noise", 1) * np.sqrt(1.2**2 + 0.03 * picture)
        picture = picture + sd * self.random.normal(0, 1, picture.shape)
        if self.condition.get("monochrome"):
            picture[..., 1:] = picture[..., :1]
        picture = np.clip(self.as_the_camera_sends_it(camera, picture), 0, 255)
        return np.round(picture).astype(np.uint8)

    def as_the_camera_has_it(self, camera, picture):
        if self.condition.get("auto_exposure"):
            picture = self.exposures[camera](picture)
        if camera in self.worn:
            picture = self.worn[camera](picture)
        haze = self.condition.get("haze", 0)
        if haze:  # little contrast, and bright tones close together
            picture = 255 * (haze + (1 - haze) * np.clip(picture / 255, 0, 1) ** self.condition["gamma"])
        return with_fringes(picture, self.condition["fringes"]) if "fringes" in self.condition else picture

    def balance(self, camera, t):
        share, phase = self.condition.get("balance", 0), {"left": 0.0}.get(camera, 2.0)
        return 1 + share * np.sin(2 * math.pi * t / 9 + phase + np.array([0, 2, 4]))

    def shaken(self, camera, picture):
        """Both pictures move alike, half of it from one to the next."""
        if camera == next(iter(self.scene.cameras)):
            sd = self.condition["shakes_px"]
            self.sway = 0.5 * self.sway + math.sqrt(0.75) * self.random.normal(0, sd, 2)
        M = np.array([[1, 0, self.sway[0]], [0, 1, self.sway[1]]])
        return cv2.warpAffine(picture, M, picture.shape[1::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def as_the_camera_sends_it(self, camera, picture):
        sharpened, trails = self.condition.get("sharpened", 0), self.condition.get("trails", 0)
        if sharpened:
            picture = picture + sharpened * (picture - cv2.GaussianBlur(picture, (0, 0), 1.2))
        if trails:
            picture = picture + trails * (self.before.get(camera, picture) - picture)
            self.before[camera] = picture
        return picture

    def place(self, t):
        """What moves besides, then the robot itself."""
        scene = self.scene
        for name, pose in (("person", lambda: person_pose(scene, self.motion, t, self.seed)),
                           ("second_arm", lambda: second_arm_pose(scene, t))):
            if self.condition.get(name):
                self.put(name, *pose())
        if self.condition.get("left_arm"):
            self.put("left_arm", *left_arm_pose(scene, self.motion, t))
        if self.condition.get("turns"):
            self.put("box", *box_pose(scene, self.motion, self.held, t, self.table_z))
        if self.condition.get("screen"):
            self.show(t)
        if self.condition.get("lamp"):
            a = self.condition["lamp"] * math.sin(2 * math.pi * t / 4)
            turn = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
            scene.model.light_dir[:] = self.swing @ turn.T
        scene.set_joints(self.motion.at(t))

    def put(self, name, at, q):
        k = self.scene.model.body(name).mocapid[0]
        self.scene.data.mocap_pos[k], self.scene.data.mocap_quat[k] = at, q

    def show(self, t):
        """A film: another picture every 0.7 s, which slides, and flickers by 10 %."""
        model = self.scene.model
        k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXTURE, "screen")
        film = np.roll(posters(np.random.default_rng(self.seed * 977 + int(t / 0.7)), 256), int(60 * t), axis=1)
        film = np.clip(film * self.random.uniform(0.9, 1.1), 0, 1)
        size = model.tex_height[k] * model.tex_width[k] * 3
        model.tex_data[model.tex_adr[k]:model.tex_adr[k] + size] = (film * 255).astype(np.uint8).ravel()
        for renderer in self.scene.renderers.values():
            if renderer._gl_context:
                renderer._gl_context.make_current()
            mujoco.mjr_uploadTexture(model, renderer._mjr_context, k)

    def pictures(self, t):
        """Of both cameras: at once, or as `interlaced_ms` and `right_late_ms` say, every second row or one camera later."""
        later = {"right": self.condition.get("right_late_ms", 0) * 1e-3}
        field = self.condition.get("interlaced_ms", 0) * 1e-3
        jitter = self.condition.get("jitter_ms", 0) * 1e-3
        begin, end = self.condition.get("frozen", (0, 0))
        off = self.random.normal(0, jitter) if jitter else 0.0
        pictures = []
        for camera in self.scene.cameras:
            at = max(0.0, t + later.get(camera, 0) + off)
            if camera == "right" and begin < at <= end:
                pictures.append(self.frozen)
                continue
            self.place(at)
            picture = self.picture(camera, at)
            if field:
                self.place(at + field)
                picture[1::2] = self.picture(camera, at + field)[1::2]
            pictures.append(picture)
        self.frozen = pictures[-1]
        return pictures

    def hand_poses(self):
        hand = self.scene.pose(self.scene.own["hand_link"])
        return {name: self.turned(k) @ np.linalg.inv(self.scene.pose(k["link"])) @ hand
                for name, k in self.scene.cameras.items()}

    def turned(self, camera):
        """A picture that is shifted by a few pixels is that of an eye that has turned by as much."""
        turn = np.eye(4)
        x, y = self.sway / [camera["fx"], camera["fy"]]
        turn[:3, :3] = cv2.Rodrigues(np.array([-y, x, 0.0]))[0]
        return turn

    def play(self, out):
        out.mkdir(parents=True, exist_ok=True)
        log = lcm.EventLog(str(out / "log.lcmlog.part"), "w", overwrite=True)
        truth = {"offsets_deg": self.offsets, "postures": self.motion.postures, "frames": []}
        prefix = "ICUB"
        sheet = []
        hz = self.condition["hz"]
        steps = ENCODERS_HZ // hz
        late = self.condition.get("late_ms", 0) * 1e-3
        for k in range(int(self.seconds * ENCODERS_HZ)):
            t = k / ENCODERS_HZ
            utime = START_US + round(1e6 * t)
            log.write_event(utime, f"{prefix}_JOINT_STATE", joint_message(*self.encoders(t), utime))
            if k % steps:
                continue
            pictures = self.pictures(max(0.0, t - late))
            self.place(max(0.0, t - late))
            truth["frames"].append({"utime": utime, **{f"hand_in_{n}_camera": X.tolist()
                                                       for n, X in self.hand_poses().items()}})
            log.write_event(utime + 4000, f"{prefix}_CAMERAS", picture_message(pictures, utime,
                                                                              self.condition.get("jpeg", 0)))
            if k % (steps * max(1, self.seconds * hz // 12)) == 0:
                sheet.append(np.hstack(pictures))
        log.close()
        rows = [np.hstack(sheet[i:i + 3]) for i in range(0, len(sheet) - len(sheet) % 3, 3)]
        cv2.imwrite(str(out / "sheet.png"), np.vstack(rows)[..., ::-1])
        (out / "truth.json").write_text(json.dumps(truth))
        (out / "log.lcmlog.part").rename(out / "log.lcmlog")


# ---- what the product says of it -----------------------------------------------------------------

def in_picture(camera, X_CP):
    x, y, z = (row[3] for row in X_CP[:3])
    if z <= 0:
        return False
    u, v = camera["fx"] * x / z + camera["cx"], camera["fy"] * y / z + camera["cy"]
    return 0 <= u < camera["width"] and 0 <= v < camera["height"]


def score(robot, estimates, truth):
    """@return of one log: hand_mm, converged and dishonest shares, first converged frame, worst hand and offset."""
    camera = configuration_of(robot)["cameras"]["left"]
    true = {frame["utime"]: np.array(frame["hand_in_left_camera"]) for frame in truth["frames"]}
    order = {utime: k for k, utime in enumerate(sorted(true))}
    counted = converged = wrong = 0
    errors, last, worst_hand, worst_offset, states, first = [], [], 0.0, 0.0, {}, None
    for line in estimates.read_text().splitlines():
        estimate = json.loads(line)
        k, X_CP = order[estimate["utime"]], true[estimate["utime"]]
        if not in_picture(camera, X_CP) or "hand_pose_left_camera" not in estimate:
            continue
        error = 1e3 * float(np.linalg.norm(np.array(estimate["hand_pose_left_camera"])[:3, 3] - X_CP[:3, 3]))
        believed = estimate["state"] == "converged"
        if believed and first is None:
            first = k
        if k < FIRST_COUNTED:
            continue
        counted += 1
        states[estimate["state"]] = states.get(estimate["state"], 0) + 1
        last.append(error)
        if not believed:
            continue
        converged += 1
        errors.append(error)
        hand_sd = error / max(1e-6, estimate["hand_sd_mm"])
        offset_sd = max(abs(estimate["offset_deg"][j] - truth["offsets_deg"][j]) / max(1e-6, estimate["stddev_deg"][j])
                        for j in truth["offsets_deg"])
        if error > 2:
            worst_hand = max(worst_hand, hand_sd)
        worst_offset = max(worst_offset, offset_sd)
        wrong += (error > 2 and hand_sd > 3) or offset_sd > 5
    return {"hand_mm": float(np.mean(errors if errors else last[-50:])) if last else math.nan,
            "converged": converged / max(1, counted), "wrong": wrong / max(1, converged), "first": first,
            "hand_sd": worst_hand, "offset_sd": worst_offset, "states": states}


def replay(program, robot, condition, folder, settings):
    command = [program, "replay", folder / "log.lcmlog", "--config", SOURCE / "config" / robot / "estimator.yaml",
               "--out", folder / "replay", "--overlays", "2", "--truth", folder / "truth.json",
               "--set", "vision.method=auto"]
    lens = "unknown" if condition.get("k1") else "[0, 0, 0, 0, 0]"
    for camera in ("left", "right"):  # what a laboratory knows of its cameras, as in `evaluate everyday`
        command += ["--set", f"cameras.{camera}.distortion={lens}", "--set", f"cameras.{camera}.readout_ms=unknown"]
    for setting in settings:
        command += ["--set", setting]
    subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return folder / "replay" / "estimates.jsonl"


def table(arguments):
    print(f"{'log':<28} {'hand, mm':>9} {'converged':>10} {'wrong':>7} {'first':>6} {'hand/sd':>8} {'offset/sd':>9}"
          "  states besides")
    wrong = 0
    for name in arguments.conditions:
        for robot in arguments.robots:
            for seed in arguments.seeds:
                folder = arguments.folder / f"{name}-{robot}-{seed}"
                if not (folder / "log.lcmlog").exists():
                    subprocess.run([sys.executable, __file__, "play", robot, name, str(seed), str(arguments.folder)],
                                   check=True)
                estimates = replay(arguments.program, robot, CONDITIONS[name], folder, arguments.set)
                s = score(robot, estimates, json.loads((folder / "truth.json").read_text()))
                wrong += s["wrong"] > 0
                states = ", ".join(f"{k} {v}" for k, v in sorted(s["states"].items()) if k != "converged")
                print(f"{folder.name:<28} {s['hand_mm']:>9.2f} {100 * s['converged']:>9.0f}% {100 * s['wrong']:>6.1f}% "
                      f"{s['first'] if s['first'] is not None else '-':>6} {s['hand_sd']:>8.1f} {s['offset_sd']:>9.1f}  "
                      f"{states}", flush=True)
    return 1 if wrong else 0


def diagnose(arguments):
    """Plays each fault for a minute and prints what `bodyschema diagnose` names."""
    for robot in arguments.robots:
        for name in arguments.faults:
            for seed in arguments.seeds:
                folder = arguments.folder / f"{name}-{robot}-{seed}"
                if not (folder / "log.lcmlog").exists():
                    subprocess.run([sys.executable, __file__, "play", robot, name, str(seed), str(arguments.folder),
                                    "--seconds", "60"], check=True)
                out = folder / "diagnosis"
                command = [arguments.program, "diagnose", folder / "log.lcmlog", "--out", out, "--config",
                           SOURCE / "config" / robot / "estimator.yaml", "--set", "vision.method=auto"]
                done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
                lines = [line for line in done.stdout.splitlines() if line and not line.startswith(("report", "next"))]
                print(f"{folder.name}: " + " | ".join(lines or done.stderr.splitlines()[-1:]), flush=True)
    return 0


def check(arguments):
    """Whether both mean the same by joints, cameras and meshes: encoders without any error, believed to have none."""
    folder = arguments.folder / f"exact-{arguments.robot}"
    Player(arguments.robot, {**PLAIN, "seconds": 6, "exact": True}, 1).play(folder)
    estimates = replay(arguments.program, arguments.robot, {}, folder, ["filter.initial_sd_deg=0.001"])
    errors = json.loads((folder / "replay/summary.json").read_text())["errors"]
    apart = max(e["final_on_all_frames"]["position_mm"]["before"] for e in errors.values())
    outline = np.median([json.loads(line)["contour_rms_px"] for line in estimates.read_text().splitlines()])
    print(f"{arguments.robot}: the hand in the cameras' frames is {apart:.6f} mm apart, outlines {outline:.3f} px (rms)")
    return 0 if apart < 1e-3 and outline < 0.3 else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("play")
    one.add_argument("robot")
    one.add_argument("condition", choices=sorted({**CONDITIONS, **FAULTS}))
    one.add_argument("seed", type=int)
    one.add_argument("folder", type=pathlib.Path)
    one.add_argument("--seconds", type=int, help="length of the log; what the condition says")
    outline = commands.add_parser("check")
    outline.add_argument("robot")
    outline.add_argument("folder", type=pathlib.Path)
    outline.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    rows = commands.add_parser("table")
    rows.add_argument("folder", type=pathlib.Path)
    rows.add_argument("--robots", nargs="+", default=["icub_right", "icub_v2_5"])
    rows.add_argument("--conditions", nargs="+", default=list(CONDITIONS))
    rows.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    rows.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE")
    rows.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    causes = commands.add_parser("diagnose")
    causes.add_argument("folder", type=pathlib.Path)
    causes.add_argument("--robots", nargs="+", default=["icub_right", "icub_v2_5"])
    causes.add_argument("--faults", nargs="+", default=list(FAULTS))
    causes.add_argument("--seeds", nargs="+", type=int, default=[1])
    causes.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    arguments = parser.parse_args()
    if arguments.command == "play":
        condition = {**CONDITIONS, **FAULTS}[arguments.condition]
        if arguments.seconds:
            condition = {**condition, "seconds": arguments.seconds}
        player = Player(arguments.robot, condition, arguments.seed)
        player.play(arguments.folder / f"{arguments.condition}-{arguments.robot}-{arguments.seed}")
        return 0
    return {"table": table, "diagnose": diagnose, "check": check}[arguments.command](arguments)


if __name__ == "__main__":
    sys.exit(main())
